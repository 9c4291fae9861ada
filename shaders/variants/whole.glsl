// What the forms of an image's whole bloom in one pass share: their parameters, the bright part of a
// texel, the kernels. All is added up in the order of the passes that they stand for, and rounded as
// those passes' images would.
#include "lib/block.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(WHOLE_BLOCK);
#include "lib/storage.glsl"
#include "lib/composite.glsl"

// Whole or not at all, a texel needs no rounding: the image has the format that it would be stored
// in.
vec3 bright(vec3 texel)
{
    vec3 value = finite_or_zero(texel);
    vec3 kept = apply_threshold(value, THRESHOLD_MODE, params.threshold, params.knee);
    return THRESHOLD_MODE == THRESHOLD_KNEE ? as_stored(kept, FORMAT) : kept;
}

float down(int tap)
{
    return params.down[abs(tap) >> 2][abs(tap) & 3];
}

float across(int tap)
{
    return params.across[abs(tap) >> 2][abs(tap) & 3];
}
