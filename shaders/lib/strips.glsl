// Gathers from pixels that are about on one line through a centre with a texel, between two radii. The
// including shader defines CENTRE, the centre in texels, STRIP_IMAGE, whose pixels these are, and
// share_for(), what the texel has of the cotangents of one of them.

// A sample is part of a texel that is less than this distance away along both axes. Rounding is less
// than 1 / 16 of a texel in a sample's place, and less than MARGIN in the radii of pixels.
const float NEAR = 1.0 + 1.0 / 16.0, MARGIN = 1.0 / 8.0;

// Part of the pixels. `facing` is 1 for pixels on the texel's side of the centre, -1 for the others, 0
// for both. The rest is for share_for().
struct Part {
    float side, outwards, facing;
};

vec4 share_for(ivec2 pixel, Part part, ivec2 texel);

// The distances from the centre of what is around a texel, the least and the largest.
vec2 distances_around(vec2 here)
{
    return vec2(length(max(abs(here) - NEAR, vec2(0.0))), length(abs(here) + NEAR));
}

// Adds up the pixels of a part between two radii, in the rows of a group.
vec4 gather_part(Part part, ivec2 texel, vec2 radii, int group, int groups)
{
    ivec2 pixels = textureSize(STRIP_IMAGE, 0);
    vec2 centre = CENTRE, here = vec2(texel) - centre;
    float reach = length(max(abs(centre), abs(vec2(pixels - 1) - centre))) + MARGIN;
    float inner = max(radii.x, 0.0), outer = min(radii.y, reach);
    vec4 sum = vec4(0.0);
    if (outer < inner)
        return sum;
    // Half of the width of a strip around the texel's line, and a box around its part between the radii.
    float distance = length(here), share = sqrt(2.0) * NEAR / distance, across = reach;
    vec2 low = vec2(-outer), high = vec2(outer);
    if (part.facing != 0.0) {
        across = outer * share + MARGIN;
        vec2 line = part.facing / distance * here;
        vec2 from = sqrt(max(inner * inner - across * across, 0.0)) * line, to = outer * line;
        low = max(low, min(from, to) - across);
        high = min(high, max(from, to) + across);
    }
    low = max(low, -centre - MARGIN);
    high = min(high, vec2(pixels) - centre + MARGIN);
    if (low.y > high.y || low.x > high.x)
        return sum;
    int middle = clamp(int(ceil(centre.x)), 0, pixels.x);
    int first_row = max(int(ceil(low.y + centre.y)), 0), last_row = min(int(floor(high.y + centre.y)), pixels.y - 1);
    for (int y = first_of_group(first_row, group, groups); y <= last_row; y += groups) {
        float down = float(y) - centre.y;
        vec2 ring = sqrt(max(vec2(inner * inner, outer * outer) - down * down, vec2(0.0)));
        vec2 row = vec2(low.x, high.x);
        if (part.facing != 0.0 && 1e6 * abs(here.y) > distance) {
            float steep = distance / abs(here.y), half_width = across * steep;
            float place = here.x * down / here.y;
            row = vec2(max(row.x, place - half_width), min(row.y, place + half_width));
            // The strip is narrower where the pixels of the row are nearer to the centre.
            float farthest = length(vec2(max(abs(row.x), abs(row.y)), down));
            half_width = min(farthest * share + MARGIN, across) * steep;
            row = vec2(max(row.x, place - half_width), min(row.y, place + half_width));
        }
        // The ring crosses the row on the left and on the right of the centre.
        for (int right = 0; right <= 1; ++right) {
            vec2 ends = right == 0 ? vec2(-ring.y, -ring.x) : ring;
            ends = vec2(max(row.x, ends.x), min(row.y, ends.y)) + centre.x;
            ends.x = min(ends.x, float(pixels.x));
            int x = max(int(ceil(ends.x)), right == 0 ? 0 : middle);
            int last = min(int(floor(ends.y)), right == 0 ? middle - 1 : pixels.x - 1);
            for (; x <= last; ++x)
                sum += share_for(ivec2(x, y), part, texel);
        }
    }
    return sum;
}
