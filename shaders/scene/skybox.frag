// The sky, sampled in the direction of a point on the cube.

layout(set = 0, binding = 1) uniform samplerCube sky;

layout(location = 0) in vec3 direction;
layout(location = 0) out vec4 colour;

void main()
{
    colour = vec4(storable(texture(sky, direction).rgb), 1.0);
}
