// The sky in the background. It is unlit and does not glow.
#include "scene/gbuffer.glsl"

layout(set = 0, binding = 1) uniform samplerCube sky;

layout(location = 0) in vec3 direction;

void main()
{
    const vec4 nothing = vec4(0.0, 0.0, 0.0, 1.0);
    albedo = vec4(storable(texture(sky, direction).rgb), 1.0);
    normal = nothing;
    position = nothing;
    brightness = nothing;
}
