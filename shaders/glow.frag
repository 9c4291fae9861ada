#version 450
#extension GL_GOOGLE_include_directive : require
// The glow mesh: its plain vertex colour at its intensity, past the threshold if there is one.
#include "block.glsl"
#include "threshold.glsl"

UNIFORM_BLOCK(MESH_BLOCK);
#include "storage.glsl"

layout(constant_id = 0) const int THRESHOLD_MODE = 0;

layout(location = 2) in vec3 vertex_colour;
layout(location = 0) out vec4 colour;

void main()
{
    vec3 bright = apply_threshold(vertex_colour * params.glow_intensity, THRESHOLD_MODE,
                                  params.threshold, params.knee);
    colour = vec4(storable(bright), 1.0);
}
