// A downsampling that is not linear, and the first pass of a published method: a choice of TAP_SET, COMBINE and point
// functions (params.h).

// Where the pass reads the image itself, as the threshold pass does.
#define TEXEL(value) (FROM_IMAGE != 0 ? finite_or_zero(value) : (value))
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/prefilter.glsl"

SAMPLED_IMAGE(SLOT_SOURCE, source);

#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"
#include "lib/prefilter_taps.glsl"

vec4 shade()
{
    Place place = EXACT == EXACT_HALF ? Place(2 * PIXEL, vec2(0.5)) : PLACE_IN(source);
    return stored(mask_value() * prefiltered(taps_at(place), place.part));
}
