// The transpose of the samples of a halo, or of the only ghost: each texel gathers the
// cotangents, which are in place of the source, of the pixels that sample it.
//
// A pixel and its samples are on one line through the centre. So the pixels that sample a texel are
// near the texel's line, in rings whose radii follow from the texel's. Of all pixels in such a part of
// a ring, the samples are computed as the forward pass does, and the texel's share of each sample. No
// pixel is in two parts.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FLARE_BLOCK);
#include "lib/fetch_inside.glsl"
#include "lib/flare.glsl"

SAMPLED_IMAGE(SLOT_SUMS, partial_sums);

#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"

#define SUMMED_IMAGE source
#define SUMS_IMAGE partial_sums
#include "lib/summed.glsl"

#define STRIP_IMAGE source
#define CENTRE (0.5 * vec2(textureSize(source, 0)) - 0.5)
#define AT_ONCE 1
#include "lib/strips.glsl"

#define IS_HALO (params.count == 0)

// The parts: `side` is -1 for the samples of red, 1 for those of blue, 0 for the others; `outwards` 1
// for pixels whose samples are on their own side of the centre, -1 for the others.

// The radii between which the pixels of a part are; the second one is less if there are none.
vec2 radii_of(Part part, vec2 here, vec2 size)
{
    vec2 low = max(abs(here) - NEAR, vec2(0.0)), high = abs(here) + NEAR;
    float least = distances_around(here).x, most = distances_around(here).y;
    float turned = part.facing * part.outwards;
    // Red and blue are moved by distances between these.
    vec2 a = vec2(low.x, high.y), b = vec2(high.x, low.y);
    vec2 moved = part.side * params.aberration
               * vec2(length(a) / length(a / size), length(b) / length(b / size));
    // The distances of the samples of green, before red and blue are moved.
    float first = (turned > 0.0 ? least : -most) - max(moved.x, moved.y);
    float last = (turned < 0.0 ? -least : most) - min(moved.x, moved.y);
    if (IS_HALO) {
        float radius = params.radius * size.y;
        last = min(last, params.width * size.y);
        first = max(first, 0.0);
        return part.outwards > 0.0 ? radius + vec2(first - MARGIN, last + MARGIN)
                                   : radius - vec2(last + MARGIN, first - MARGIN);
    }
    float scale = params.ghosts[0].w;
    if (scale * part.outwards < 0.0)
        return vec2(0.0, -1.0);
    return vec2(max(first, 0.0), last) / abs(scale) + vec2(-MARGIN, MARGIN);
}

// The share that a texel has of the sample at an offset from the centre.
float share_of(vec2 offset, ivec2 texel)
{
    Place place = place_from_centre(offset);
    ivec2 next = texel - place.texel;
    if (any(notEqual(next & 1, next)))
        return 0.0;
    vec2 shares = mix(1.0 - place.part, place.part, equal(next, ivec2(1)));
    return shares.x * shares.y;
}

// What a texel has of the cotangents of a pixel.
vec4 share_for(ivec2 pixel, Part part, ivec2 texel)
{
    vec2 place = vec2(pixel) - CENTRE, here = vec2(texel) - CENTRE;
    vec2 offset = flare_offset(place);
    bool outside = dot(offset, place) >= 0.0, moves = is_aberrated(offset);
    if (place == vec2(0.0) || part.facing * dot(place, here) < 0.0
        || (IS_HALO && outside != part.outwards > 0.0) || (part.side != 0.0 && !moves))
        return vec4(0.0);
    float share = share_of(part.side == 0.0 ? offset : aberrated(offset, part.side), texel);
    vec4 channels = part.side < 0.0 ? vec4(1.0, 0.0, 0.0, 0.0)
                  : part.side > 0.0 ? vec4(0.0, 0.0, 1.0, 0.0)
                  : moves           ? vec4(0.0, 1.0, 0.0, 1.0)
                                    : vec4(1.0);
    return share > 0.0 ? share * channels * texelFetch(source, pixel, 0) : vec4(0.0);
}

vec4 gather(ivec2 texel, int first_row, int last_row)
{
    // Near the centre, samples of pixels on both sides are around the texel.
    vec2 size = vec2(textureSize(source, 0)), here = vec2(texel) - CENTRE;
    bool both = length(here) <= 2.0;
    float sides = params.aberration > 0.0 ? 1.0 : 0.0;
    vec4 sum = vec4(0.0);
    for (float side = -sides; side <= sides; side += 1.0)
        for (float outwards = -1.0; outwards <= 1.0; outwards += 2.0)
            for (float facing = both ? 0.0 : -1.0; facing <= (both ? 0.0 : 1.0); facing += 2.0) {
                Part part = Part(side, outwards, facing);
                sum += gather_part(part, texel, radii_of(part, here, size), first_row, last_row);
            }
    return sum;
}

vec4 shade()
{
    vec4 sum = gather_summed();
    // The pixel in the centre samples itself.
    if (PARTIAL_SUMS != 0)
        return sum;
    if (params.summed_first == 0 && FROM_CENTRE == vec2(0.0))
        sum += texelFetch(source, PIXEL, 0);
    return gathered(sum);
}
