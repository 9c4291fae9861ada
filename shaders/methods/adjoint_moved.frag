// The transpose of the samples of a halo, or of the only ghost: each texel gathers the
// cotangents, which are in place of the source, of the pixels that sample it.
//
// A pixel and its samples are on one line through the centre. So the pixels that sample a texel are
// the texel's surroundings, multiplied by factors that follow from its distance: in a box. Where this
// distance is short, a box would have many other pixels, and those near the texel's line are taken, in
// rings whose radii follow from the texel's. Of all these pixels, the samples are computed as the forward
// pass does, and the texel's share of each sample. No pixel is in two parts.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FLARE_BLOCK);
#include "lib/fetch_inside.glsl"
#include "lib/flare.glsl"

SAMPLED_IMAGE(SLOT_SUMS, partial_sums);

#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"

#define SUMS_IMAGE partial_sums
#include "lib/summed.glsl"

#define STRIP_IMAGE source
#define CENTRE (0.5 * vec2(textureSize(source, 0)) - 0.5)
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

// The factors between which the pixels of a part are from what is around a texel, whose samples are all on the texel's
// side of the centre; the second one is less if there are none.
vec2 factors_of(Part part, vec2 here, vec2 size)
{
    vec2 low = max(abs(here) - NEAR, vec2(0.0)), high = abs(here) + NEAR, around = distances_around(here);
    // Before red and blue are moved.
    vec2 kept = 1.0 - part.side * params.aberration / vec2(length(low / size), length(high / size));
    kept = vec2(min(kept.x, kept.y), max(kept.x, kept.y));
    if (!IS_HALO)
        return part.outwards * params.ghosts[0].w < 0.0 ? vec2(1.0, 0.0)
             : params.ghosts[0].w > 0.0                 ? kept / params.ghosts[0].w
                                                        : kept.yx / params.ghosts[0].w;
    if (around.x * kept.x > params.width * size.y)
        return vec2(1.0, 0.0);
    float radius = part.outwards * params.radius * size.y;
    return kept + radius / (radius > 0.0 ? around.yx : around);
}

// The least and the largest product of an edge and a factor.
vec2 range_of(float edge, vec2 factors)
{
    vec2 near = (edge - NEAR) * factors, far = (edge + NEAR) * factors;
    return vec2(min(min(near.x, near.y), min(far.x, far.y)), max(max(near.x, near.y), max(far.x, far.y)));
}

// Adds up the pixels of a part in a box, in the rows of a group.
vec4 gather_box(Part part, ivec2 texel, vec2 factors, int group, int groups)
{
    ivec2 pixels = textureSize(source, 0);
    vec2 centre = CENTRE, here = vec2(texel) - centre;
    vec4 sum = vec4(0.0);
    if (factors.y < factors.x)
        return sum;
    vec2 x = clamp(range_of(here.x, factors) + centre.x, -1.0, float(pixels.x));
    vec2 y = clamp(range_of(here.y, factors) + centre.y, -1.0, float(pixels.y));
    ivec2 first = max(ivec2(ceil(vec2(x.x, y.x))), ivec2(0)), last = min(ivec2(floor(vec2(x.y, y.y))), pixels - 1);
    for (int row = first_of_group(first.y, group, groups); row <= last.y; row += groups)
        for (int column = first.x; column <= last.x; ++column)
            sum += share_for(ivec2(column, row), part, texel);
    return sum;
}

// Whether boxes have few other pixels: those of a halo are as many times wider than a texel as they are farther away.
bool fits_boxes(vec2 here, vec2 size)
{
    float distance = length(here), moved = params.aberration * max(size.x, size.y);
    return distance > moved + 4.0 && (!IS_HALO || 2.0 * distance > params.radius * size.y);
}

vec4 gather(ivec2 texel, int group, int groups)
{
    // Near the centre, samples of pixels on both sides are around the texel.
    vec2 size = vec2(textureSize(source, 0)), here = vec2(texel) - CENTRE;
    bool both = length(here) <= 2.0, boxes = fits_boxes(here, size);
    float sides = params.aberration > 0.0 ? 1.0 : 0.0;
    vec4 sum = vec4(0.0);
    for (float side = -sides; side <= sides; side += 1.0)
        for (float outwards = -1.0; outwards <= 1.0; outwards += 2.0) {
            if (boxes) {
                Part part = Part(side, outwards, 0.0);
                sum += gather_box(part, texel, factors_of(part, here, size), group, groups);
                continue;
            }
            for (float facing = both ? 0.0 : -1.0; facing <= (both ? 0.0 : 1.0); facing += 2.0) {
                Part part = Part(side, outwards, facing);
                sum += gather_part(part, texel, radii_of(part, here, size), group, groups);
            }
        }
    return sum;
}

vec4 shade()
{
    if (PARTIAL_SUMS != 0) {
        Gathered own = gathered_at(PIXEL);
        return own.groups > 0 ? gather(own.texel, own.group, own.groups) : vec4(0.0);
    }
    vec4 sum = number_of_block(PIXEL) < 0 ? gather(PIXEL, 0, 1) : sum_of_groups(PIXEL);
    // The pixel in the centre samples itself.
    if (FROM_CENTRE == vec2(0.0))
        sum += texelFetch(source, PIXEL, 0);
    return gathered(sum);
}
