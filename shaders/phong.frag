#version 450
#extension GL_GOOGLE_include_directive : require
// The lit mesh of the forward system.
#include "phong.glsl"

layout(location = 0) in vec3 view_position;
layout(location = 1) in vec3 view_normal;
layout(location = 2) in vec3 vertex_colour;
layout(location = 0) out vec4 colour;

void main()
{
    colour = vec4(phong(vertex_colour, normalize(view_normal), view_position), 1.0);
}
