// Of a blur along one axis, the sums by four of its weights: what the taps with each of these sample, times cotangents of
// the other axis.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FILTER_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#include "lib/values.glsl"
#include "lib/target_cotangents.glsl"

vec4 values()
{
    vec4 cotangent = cotangent_of_target(), products = vec4(0.0);
    // What it would be multiplied by may be infinite.
    if (cotangent == vec4(0.0))
        return products;
    Place place = PLACE_IN(source);
    for (int i = 0; i < 4; ++i) {
        int tap = FIRST_SAMPLE + i;
        vec2 offset = float(tap) * vec2(params.step_x, params.step_y);
        vec4 taken = sample_at(source, place, offset, SAMPLING);
        if (tap > 0)
            taken += sample_at(source, place, -offset, SAMPLING);
        products[i] = tap <= RADIUS ? dot(cotangent, taken) : 0.0;
    }
    return products;
}
