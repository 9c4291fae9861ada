#version 450
// The sky, looked up by the position on the cube.

layout(set = 0, binding = 1) uniform samplerCube sky;

layout(location = 0) in vec3 direction;
layout(location = 0) out vec4 colour;

void main()
{
    colour = vec4(texture(sky, direction).rgb, 1.0);
}
