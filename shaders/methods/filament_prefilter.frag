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
    vec2 part = place.part;
    // Along an axis the texels at -1 .. 2 have the weights (1 - f, 2 - f, 1 + f, f) / 4. Two
    // bilinear taps, each between two texels, give these weights.
    vec2 left_share = 0.25 * (3.0 - 2.0 * part), right_share = 0.25 * (1.0 + 2.0 * part);
    vec2 left = (2.0 - part) / (3.0 - 2.0 * part) - 1.0 - part;
    vec2 right = 1.0 + part / (1.0 + 2.0 * part) - part;
    vec2 offsets[4] = vec2[](left, vec2(right.x, left.y), vec2(left.x, right.y), right);
    vec4 shares = vec4(left_share.x, right_share.x, left_share.x, right_share.x)
                * vec4(left_share.yy, right_share.yy);
    vec4 taps[4];
    for (int i = 0; i < 4; ++i)
        taps[i] = sample_at(source, place, offsets[i], SAMPLING);
    return stored(mask_value() * filament_prefiltered(taps, shares));
}
