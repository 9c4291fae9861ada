#version 450
#extension GL_GOOGLE_include_directive : require
// Filament's reduction: a 3 x 3 binomial filter as four bilinear taps. With the threshold it also
// has a firefly filter, which weights the taps by brightness (google/filament,
// bloomDownsample2x.mat @ 9f62dc2f2f53).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"

float brightest(vec3 value)
{
    return max(max(value.r, max(value.g, value.b)), 0.0);
}

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
    vec4 sum = vec4(0.0);
    float total = 0.0;
    for (int i = 0; i < 4; ++i) {
        vec4 value = sample_at(source, place, offsets[i], SAMPLING);
        float share = shares[i];
        if (THRESHOLDED != 0)
            share /= 1.0 + brightest(value.rgb);
        sum += share * value;
        total += share;
    }
    sum /= total;
    if (THRESHOLDED != 0) {
        vec3 kept = max(sum.rgb - params.threshold, vec3(0.0));
        kept /= 1.0 + brightest(kept) / params.highlight;
        // The threshold subtracts from colours. The alpha is multiplied by the factor of the
        // brightest channel.
        float value = brightest(sum.rgb);
        sum = vec4(kept, value > 0.0 ? sum.a * (brightest(kept) / value) : 0.0);
    }
    return stored(mask_value() * sum);
}
