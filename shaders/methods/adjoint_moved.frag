#version 450
#extension GL_GOOGLE_include_directive : require
// The transpose of the samples of a halo, or of a ghost of number LEVELS: each texel gathers the
// cotangents, which are in place of the source, of the pixels that sample it.
//
// A pixel and its samples are on one line through the centre. So the pixels that sample a texel are
// near the texel's line, in rings whose radii follow from the texel's. Of all pixels in such a part of
// a ring, the samples are computed as the forward pass does, and the texel's share of each sample. No
// pixel is in two parts.
#include "lib/block.glsl"
#include "lib/finite.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FLARE_BLOCK);
#include "lib/glare.glsl"
#include "lib/flare.glsl"

layout(set = 0, binding = 2) uniform sampler2D partial_sums;

#define TARGET_BINDING 5
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"

#define SUMMED_IMAGE source
#define PARTIAL_SUMS partial_sums
#include "lib/summed.glsl"

// A sample is part of a texel that is less than this distance away along both axes. Rounding is less
// than 1 / 16 of a texel in a sample's place, and less than a pixel in the radii of pixels.
const float NEAR = 1.0 + 1.0 / 16.0, MARGIN = 1.0;

// Part of the pixels: `side` is -1 for the samples of red, 1 for those of blue, 0 for the others;
// `outwards` 1 for pixels whose samples are on their own side of the centre, -1 for the others;
// `facing` 1 for pixels on the texel's side of the centre, -1 for the others, 0 for both.
struct Part {
    float side, outwards, facing;
};

// The radii between which the pixels of a part are; the second one is less if there are none.
vec2 radii_of(Part part, vec2 here, vec2 size)
{
    vec2 low = max(abs(here) - NEAR, vec2(0.0)), high = abs(here) + NEAR;
    float least = length(low), most = length(high), turned = part.facing * part.outwards;
    // Red and blue are moved by distances between these.
    vec2 a = vec2(low.x, high.y), b = vec2(high.x, low.y);
    vec2 moved = part.side * params.aberration
               * vec2(length(a) / length(a / size), length(b) / length(b / size));
    // The distances of the samples of green, before red and blue are moved.
    float first = (turned > 0.0 ? least : -most) - max(moved.x, moved.y);
    float last = (turned < 0.0 ? -least : most) - min(moved.x, moved.y);
    if (is_halo()) {
        float radius = params.radius * size.y;
        last = min(last, params.width * size.y);
        first = max(first, 0.0);
        return part.outwards > 0.0 ? radius + vec2(first - MARGIN, last + MARGIN)
                                   : radius - vec2(last + MARGIN, first - MARGIN);
    }
    float scale = params.ghosts[LEVELS].w;
    if (scale * part.outwards < 0.0)
        return vec2(0.0, -1.0);
    return vec2(max(first, 0.0), last) / abs(scale) + vec2(-MARGIN, MARGIN);
}

// The share that a texel has of the sample at an offset from the centre.
float share_of(vec2 offset, ivec2 texel)
{
    vec2 part;
    ivec2 place = texel - texel_from_centre(offset, part);
    if (any(notEqual(place & 1, place)))
        return 0.0;
    vec2 shares = mix(1.0 - part, part, equal(place, ivec2(1)));
    return shares.x * shares.y;
}

// What a pixel brings to a texel.
vec4 brought_by(ivec2 pixel, Part part, ivec2 texel)
{
    vec2 centre = 0.5 * vec2(textureSize(source, 0)) - 0.5;
    vec2 place = vec2(pixel) - centre, here = vec2(texel) - centre;
    vec2 offset = flare_offset(LEVELS, place);
    bool outside = dot(offset, place) >= 0.0, moves = is_aberrated(offset);
    if (place == vec2(0.0) || part.facing * dot(place, here) < 0.0
        || (is_halo() && outside != part.outwards > 0.0) || (part.side != 0.0 && !moves))
        return vec4(0.0);
    float share = share_of(part.side == 0.0 ? offset : aberrated(offset, part.side), texel);
    vec4 channels = part.side < 0.0 ? vec4(1.0, 0.0, 0.0, 0.0)
                  : part.side > 0.0 ? vec4(0.0, 0.0, 1.0, 0.0)
                  : moves           ? vec4(0.0, 1.0, 0.0, 1.0)
                                    : vec4(1.0);
    return share > 0.0 ? share * channels * texelFetch(source, pixel, 0) : vec4(0.0);
}

// Adds up the pixels of a part between two rows.
vec4 gather_part(Part part, ivec2 texel, int first_row, int last_row)
{
    ivec2 pixels = textureSize(source, 0);
    vec2 size = vec2(pixels), centre = 0.5 * size - 0.5, here = vec2(texel) - centre;
    vec2 radii = radii_of(part, here, size);
    float reach = 0.5 * length(size) + MARGIN, inner = max(radii.x, 0.0), outer = min(radii.y, reach);
    vec4 sum = vec4(0.0);
    if (outer < inner)
        return sum;
    // Half of the width of a strip around the texel's line, and a box around its part between the radii.
    float distance = length(here), across = reach;
    vec2 low = vec2(-outer), high = vec2(outer);
    if (part.facing != 0.0) {
        across = outer * sqrt(2.0) * NEAR / distance + MARGIN;
        vec2 line = part.facing / distance * here;
        vec2 from = sqrt(max(inner * inner - across * across, 0.0)) * line, to = outer * line;
        low = max(low, min(from, to) - across);
        high = min(high, max(from, to) + across);
    }
    last_row = min(int(floor(high.y + centre.y)), last_row);
    for (int y = max(int(ceil(low.y + centre.y)), first_row); y <= last_row; ++y) {
        float down = float(y) - centre.y;
        vec2 ring = sqrt(max(vec2(inner * inner, outer * outer) - down * down, vec2(0.0)));
        vec2 row = vec2(low.x, high.x);
        if (part.facing != 0.0 && here.y != 0.0) {
            float middle = here.x * down / here.y, half_width = across * distance / abs(here.y);
            row = vec2(max(row.x, middle - half_width), min(row.y, middle + half_width));
        }
        // The ring crosses the row on the left and on the right of the middle.
        for (int right = 0; right <= 1; ++right) {
            vec2 ends = right == 0 ? vec2(-ring.y, -ring.x) : ring;
            ends = vec2(max(row.x, ends.x), min(row.y, ends.y)) + centre.x;
            int middle = pixels.x / 2, x = max(int(ceil(ends.x)), right == 0 ? 0 : middle);
            int last = min(int(floor(ends.y)), right == 0 ? middle - 1 : pixels.x - 1);
            for (; x <= last; ++x)
                sum += brought_by(ivec2(x, y), part, texel);
        }
    }
    return sum;
}

vec4 gather(ivec2 texel, int first_row, int last_row)
{
    // Near the centre, samples of pixels on both sides are around the texel.
    vec2 here = vec2(texel) + 0.5 - 0.5 * vec2(textureSize(source, 0));
    bool both = length(here) <= 2.0;
    float sides = params.aberration > 0.0 ? 1.0 : 0.0;
    vec4 sum = vec4(0.0);
    for (float side = -sides; side <= sides; side += 1.0)
        for (float outwards = -1.0; outwards <= 1.0; outwards += 2.0)
            for (float facing = both ? 0.0 : -1.0; facing <= (both ? 0.0 : 1.0); facing += 2.0)
                sum += gather_part(Part(side, outwards, facing), texel, first_row, last_row);
    return sum;
}

vec4 shade()
{
    vec4 sum = gather_summed();
    // The pixel in the centre samples itself.
    if (STAGE != STAGE_FIRST && FROM_CENTRE == vec2(0.0))
        sum += texelFetch(source, PIXEL, 0);
    return gathered(sum);
}
