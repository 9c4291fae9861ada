// The transpose of Blender's sun beams (sun_beams.frag), from the cotangents of the sums that these are means of
// (adjoint_beam_means.frag). Each texel gathers those of the pixels that sample it: they are behind it, as seen from
// the sun, or with jitter, whose last samples are beyond the sun, on its other side.

UNIFORM_BLOCK(SUN_BEAMS_BLOCK);
#include "lib/beam.glsl"

SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);
SAMPLED_IMAGE(SLOT_SUMS, partial_sums);

#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"

#define SUMMED_IMAGE cotangents
#define SUMS_IMAGE partial_sums
#include "lib/summed.glsl"

#define STRIP_IMAGE cotangents
#define CENTRE texels_of(vec2(params.sun_x, params.sun_y), textureSize(cotangents, 0))
#define AT_ONCE 4
#include "lib/strips.glsl"

// The share of a sample, in texels, that a texel has.
float share_of(vec2 place, ivec2 texel)
{
    vec2 integer = floor(place), part = place - integer;
    ivec2 next = texel - ivec2(integer);
    if (any(notEqual(next & 1, next)))
        return 0.0;
    vec2 shares = mix(1.0 - part, part, equal(next, ivec2(1)));
    return shares.x * shares.y;
}

// Steps are at least half a texel long on one axis, but near the sun, where there are no more than two of
// them. So no more than five samples of a pixel are NEAR a texel.
const int MOST_SAMPLES = 5;
const float LEAST_STEP = 0.5;

vec4 share_for(ivec2 pixel, Part part, ivec2 texel)
{
    ivec2 size = textureSize(cotangents, 0);
    vec2 here = vec2(texel) - CENTRE;
    if (part.facing * dot(vec2(pixel) - CENTRE, here) < 0.0)
        return vec4(0.0);
    Beam beam = beam_of(pixel, size);
    vec2 way = beam.towards * vec2(size), distance = vec2(texel - pixel);
    bool along_x = abs(way.x) > abs(way.y);
    float step = along_x ? way.x : way.y, whole = along_x ? distance.x : distance.y;
    // The first sample that is near.
    int start = 0;
    if (abs(step) >= LEAST_STEP) {
        float first = whole / step - NEAR / abs(step);
        first = IS_JITTERED ? first * params.left - beam.offset : first;
        start = int(ceil(clamp(first, 0.0, float(beam.last))));
    }
    float sum = 0.0;
    [[unroll]] for (int i = 0; i < MOST_SAMPLES; ++i) {
        float at = steps_to(beam, start + i);
        vec2 place = beam.share + at * beam.towards;
        if (start + i <= beam.last && is_place(place))
            sum += weight_at(beam, at) * share_of(texels_of(place, size), texel);
    }
    return sum > 0.0 ? sum * texelFetch(cotangents, pixel, 0) : vec4(0.0);
}

vec4 gather(ivec2 texel, int first_row, int last_row)
{
    vec2 here = vec2(texel) - CENTRE, around = distances_around(here);
    // How far away a pixel may be from its samples, and these from the sun, beyond it.
    float beyond = !IS_JITTERED ? 0.0 : params.left > 0.0 ? 2.0 / params.left : 2.0;
    float most = params.left > 0.0 ? float(params.most) + 2.0 + beyond : 4.0;
    bool both = length(here) <= 2.0;
    vec4 sum = vec4(0.0);
    for (float facing = both ? 0.0 : -1.0; facing <= (both ? 0.0 : 1.0); facing += 2.0) {
        vec2 radii = vec2(facing > 0.0 ? around.x : 0.0, around.y + most) + vec2(-MARGIN, MARGIN);
        if (facing < 0.0)
            radii.y = IS_JITTERED && around.x <= beyond + 2.0 ? most - around.x + MARGIN : -1.0;
        sum += gather_part(Part(0.0, 1.0, facing), texel, radii, first_row, last_row);
    }
    return sum;
}

vec4 shade()
{
    vec4 sum = gather_summed();
    if (PARTIAL_SUMS != 0)
        return sum;
    // A pixel without weights shows itself.
    if (IS_JITTERED && params.summed_first == 0 && weights_of(PIXEL, textureSize(cotangents, 0)) == 0.0)
        sum += texelFetch(cotangents, PIXEL, 0);
    return gathered(sum);
}
