// A blur by a symmetric kernel, in one direction or, as one N x N pass, in both. The source may
// have another size than the target.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FILTER_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, source);

#include "lib/fullscreen.glsl"

float weight(int tap)
{
    return params.weights[abs(tap) >> 2][abs(tap) & 3];
}

// The position of a tap in steps: its number, unless offsets are given.
float place_of(int tap)
{
    if (PLACED == 0)
        return float(tap);
    float distance = params.offsets[abs(tap) >> 2][abs(tap) & 3];
    return tap < 0 ? -distance : distance;
}

// URP 17: no tap is beyond the middle of the last two columns.
vec2 within(Place place, vec2 offset)
{
    if (UPSAMPLE == UPSAMPLE_INSET_LINEAR) {
        float last = float(textureSize(source, 0).x - place.texel.x) - 1.5;
        offset.x = min(offset.x, last - place.part.x);
    }
    return offset;
}

// Adds from the first tap to the last, as all variants of a blur, so that they round identically. Taps that
// are several texels apart have others without a weight between them.
vec4 blur_line(Place place, vec2 centre, vec2 tap_step)
{
    vec4 sum = vec4(0.0);
    for (int tap = -RADIUS; tap <= RADIUS; ++tap)
        if (weight(tap) != 0.0)
            sum += weight(tap)
                 * sample_at(source, place, within(place, centre + place_of(tap) * tap_step), SAMPLING);
    return sum;
}

vec4 shade()
{
    Place place = PLACE_IN(source);
    vec2 step_x = vec2(params.step_x, 0.0), step_y = vec2(0.0, params.step_y);
    if (DIRECTION != DIRECTION_BOTH) {
        vec2 tap_step = DIRECTION == DIRECTION_VERTICAL ? step_y : step_x;
        return stored(blur_line(place, vec2(0.0), tap_step));
    }
    vec4 sum = vec4(0.0);
    for (int tap = -RADIUS; tap <= RADIUS; ++tap)
        sum += weight(tap) * blur_line(place, float(tap) * step_y, step_x);
    return stored(params.coarse * sum);
}
