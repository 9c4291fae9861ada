// Shared by the fused passes for the complete bloom of an image: parameters, threshold, kernels. They
// add in the same order as the passes that they replace, and round where those store to an image.

UNIFORM_BLOCK(FUSED_BLOOM_BLOCK);
#include "lib/composite.glsl"

// The result of the threshold pass. Without a knee it needs no rounding: it is the texel or 0, and
// the image has the format in which the pass would store it.
vec3 thresholded(vec3 texel)
{
    vec3 value = finite_or_zero(texel);
    vec3 kept = apply_threshold(value, THRESHOLD_MODE, params.threshold, params.knee);
    return THRESHOLD_MODE == THRESHOLD_KNEE ? as_stored(kept, FORMAT) : kept;
}

float vertical_weight(int tap)
{
    return params.vertical[abs(tap) >> 2][abs(tap) & 3];
}

float horizontal_weight(int tap)
{
    return params.horizontal[abs(tap) >> 2][abs(tap) & 3];
}
