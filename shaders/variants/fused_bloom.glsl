// Shared by the fused passes for the complete bloom of an image: parameters, threshold, kernels. They
// add in the same order as the passes that they replace, and round where those store to an image.

UNIFORM_BLOCK(FUSED_BLOOM_BLOCK);
#include "lib/composite.glsl"
#include "lib/ended.glsl"

// The result of the threshold pass. Without a knee it needs no rounding: it is the texel or 0, and
// the image has the format in which the pass would store it.
vec3 thresholded(vec3 texel)
{
    vec3 value = finite_or_zero(texel);
    vec3 kept = apply_threshold(value, THRESHOLD_MODE, params.threshold, params.knee);
    return THRESHOLD_MODE == THRESHOLD_KNEE ? as_stored(kept, FORMAT) : kept;
}

// A sum that a pass would store. Those of the transpose are not rounded.
vec3 kept(vec3 sum)
{
    return TRANSPOSED != 0 ? sum : as_stored(sum, FORMAT);
}

float kernel_weight(bool vertical, int tap)
{
    return vertical ? params.vertical[abs(tap) >> 2][abs(tap) & 3] : params.horizontal[abs(tap) >> 2][abs(tap) & 3];
}

// The weights of the taps beyond the edge of a pixel at this distance from it. The transpose of a blur whose taps
// beyond an edge read the edge has the same symmetric kernel: there are no cotangents beyond the edges, and the texel
// at an edge also has what the taps beyond it have read. The loop stays one: unrolled, `Separable` takes 397 us backwards
// in tiles in place of 362 (3840 x 2160 in float32, H100).
float weight_beyond(bool vertical, int distance, int radius)
{
    float sum = 0.0;
    [[dont_unroll]] for (int tap = distance + 1; tap <= radius; ++tap)
        sum += kernel_weight(vertical, tap);
    return sum;
}
