#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// URP's prefilter: one bilinear tap.
#include "lib/block.glsl"
#include "lib/sampling.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"
#include "lib/prefilters.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"

vec4 shade()
{
    vec4 value = sample_at(source, PLACE_IN(source), vec2(0.0), SAMPLING);
    return stored(mask_value() * urp_prefiltered(value));
}
