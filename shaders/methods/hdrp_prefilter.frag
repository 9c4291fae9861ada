#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// HDRP's prefilter: the centre and four diagonal taps.
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
    Place place = PLACE_IN(source);
    vec4 taps[5];
    for (int i = 0; i < 5; ++i)
        taps[i] = sample_at(source, place, HDRP_OFFSETS[i], SAMPLING);
    return stored(mask_value() * hdrp_prefiltered(taps));
}
