// The lit mesh of the forward system.
#include "scene/phong.glsl"
#include "scene/surface.glsl"

layout(location = 0) in vec3 view_position;
layout(location = 1) in vec3 view_normal;
layout(location = 0) out vec4 colour;

void main()
{
    colour = vec4(phong(surface_colour(), LAMP, normalize(view_normal), view_position), 1.0);
}
