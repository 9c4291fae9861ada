// Of a blur along one axis, the sums by four of its weights: what the taps with each of these sample, times cotangents of
// the other axis.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FILTER_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#include "lib/values.glsl"
#include "lib/target_cotangents.glsl"

// A sample between two texels of the axis, of which the second one is `next` from the first.
vec4 sample_between(Place place, vec2 offset, ivec2 next)
{
    vec2 moved = place.part + offset, whole = floor(moved);
    ivec2 first = place.texel + ivec2(whole);
    float part = dot(moved - whole, vec2(next));
    return mix(fetch_clamped(source, first), fetch_clamped(source, first + next), part);
}

vec4 sample_tap(Place place, vec2 offset, ivec2 next)
{
    return SAMPLING == SAMPLING_TEXEL ? fetch_clamped(source, place.texel + ivec2(offset))
                                      : sample_between(place, offset, next);
}

vec4 values()
{
    vec4 cotangent = cotangent_of_target(), products = vec4(0.0);
    // What it would be multiplied by may be infinite.
    if (cotangent == vec4(0.0))
        return products;
    Place place = PLACE_IN(source);
    vec2 apart = vec2(params.step_x, params.step_y);
    ivec2 next = DIRECTION == DIRECTION_VERTICAL ? ivec2(0, 1) : ivec2(1, 0);
    for (int i = 0; i < 4; ++i) {
        int tap = FIRST_SAMPLE + i;
        vec4 taken = sample_tap(place, float(tap) * apart, next);
        if (tap > 0)
            taken += sample_tap(place, -float(tap) * apart, next);
        products[i] = tap <= RADIUS ? dot(cotangent, taken) : 0.0;
    }
    return products;
}
