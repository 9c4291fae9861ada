#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// Filament's reduction: a 3 x 3 binomial filter as four bilinear taps.
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
    FilamentTaps at = filament_taps(place.part);
    vec2 offsets[4] = vec2[](at.left, vec2(at.right.x, at.left.y), vec2(at.left.x, at.right.y),
                             at.right);
    vec4 taps[4];
    for (int i = 0; i < 4; ++i)
        taps[i] = sample_at(source, place, offsets[i], SAMPLING);
    return stored(mask_value() * filament_prefiltered(taps, at.shares));
}
