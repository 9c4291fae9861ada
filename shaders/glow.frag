#version 450
#extension GL_GOOGLE_include_directive : require
// The glow mesh: its plain vertex colour, past the threshold if there is one.
#include "block.glsl"
#include "threshold.glsl"

UNIFORM_BLOCK(MESH_BLOCK);

layout(constant_id = 0) const int THRESHOLD_MODE = 0;

layout(location = 2) in vec3 vertex_colour;
layout(location = 0) out vec4 colour;

void main()
{
    colour = vec4(apply_threshold(vertex_colour, THRESHOLD_MODE, params.threshold, params.knee),
                  1.0);
}
