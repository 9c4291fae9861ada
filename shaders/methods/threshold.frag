// The threshold pass: reduces an image to the size of the bloom buffers, then applies the threshold.
// NaN and infinity become 0 first, since the filter would spread them.

#define TEXEL(value) finite_or_zero(value)
#include "lib/sampling.glsl"

UNIFORM_BLOCK(THRESHOLD_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, image);

#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"

vec4 shade()
{
    Place place = PLACE_IN(image);
    // Rounding in the filter must not lift pixels of a flat area over the threshold.
    bool within = THRESHOLD_MODE == THRESHOLD_HARD && SAMPLING == SAMPLING_FETCH;
    vec4 reduced = within ? fetch_within(image, place)
                          : sample_at(image, place, vec2(0.0), SAMPLING);
    vec4 kept = apply_threshold(reduced, THRESHOLD_MODE, params.threshold, params.knee);
    return stored(mask_value() * kept);
}
