// The lit mesh of the forward system, with its emission if EMITTERS is not 0.
#include "scene/phong.glsl"
#include "scene/surface.glsl"

layout(location = 0) out vec4 colour;

void main()
{
    vec3 lit = phong(surface_colour(), normalize(view_normal), view_position);
    if (EMITTERS != 0)
        lit += surface_emission();
    colour = vec4(storable(lit), 1.0);
}
