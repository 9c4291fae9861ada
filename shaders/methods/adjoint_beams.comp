// The transpose of Blender's sun beams (sun_beams.frag), from the cotangents of the sums that these are means of
// (adjoint_beam_means.frag). Each texel gathers those of the pixels that sample it. An invocation has a cell of 2 x 2
// texels, since most of the work for a pixel is the same for all of them.
//
// A pixel and its samples are on one line through the sun. So the pixels that sample a cell are seen from the sun where
// its surroundings are: between two slopes. They are behind the cell or, with jitter, whose last samples are beyond the
// sun, on its other side. Lines of pixels across the cell's longer axis have those between the slopes next to each
// other.

UNIFORM_BLOCK(SUN_BEAMS_BLOCK);
#include "lib/beam.glsl"

SAMPLED_IMAGE(SLOT_SOURCE, frame); // of which the highlights are made
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);
SAMPLED_IMAGE(SLOT_SUMS, partial_sums);

layout(local_size_x = PIXEL_INVOCATIONS, local_size_y = PIXEL_INVOCATIONS) in;
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

// The first texel of the cell, or the one that is stored.
ivec2 texel_of_target = BEAM_CELL * ivec2(gl_GlobalInvocationID.xy);
#define PIXEL texel_of_target

#include "lib/adjoint.glsl"
#define SUMS_IMAGE partial_sums
#include "lib/summed.glsl"

#define CENTRE texels_of(vec2(params.sun_x, params.sun_y), textureSize(cotangents, 0))

// A sample is part of a cell that is less than this far away from its centre along both axes, but for rounding.
const float NEAR = 1.0 + 0.5 * float(BEAM_CELL - 1), MARGIN = 1.0 / 64.0;
// Cells whose longer axis is shorter than this gather from all pixels.
const float MIN_LONGER = NEAR + 0.5;
// Steps are at least half a texel long on a pixel's longer axis, but near the sun, where there are no more than two of
// them. So no more than six samples of a pixel are in the surroundings of a cell; fewer, if steps are not short.
const float MIN_STEP = 0.5;
const int MAX_SAMPLES = 6;

// What the texels of a cell have of the samples of a pixel: the sums of their weights. Places are relative to the cell,
// which needs fewer operations than beam_of(); the number of steps has its bits. Only where a texel is at the edge may
// samples that are outside of the image be near it.
vec4 weights_for(vec2 pixel, vec2 cell, bool is_at_edge)
{
    vec2 size = vec2(textureSize(cotangents, 0)), sun = vec2(params.sun_x, params.sun_y);
    vec2 corner = vec2(pixel.x, size.y - 1.0 - pixel.y);
    float distance = max(length(corner - vec2(sun.x, 1.0 - sun.y) * size), 1.0);
    float steps = min(float(params.most), floor(distance)), offset = IS_JITTERED ? hashed(uvec2(corner)) : 0.0;
    float last = IS_JITTERED ? floor(params.left * steps) : steps;
    vec2 place = pixel - cell, way = (CENTRE - pixel) / distance;
    bool along_x = abs(way.x) > abs(way.y);
    float step = along_x ? way.x : way.y, whole = (along_x ? place.x : place.y) - 0.5 * float(BEAM_CELL - 1);
    float start = 0.0;
    // The first sample that is near.
    if (abs(step) >= MIN_STEP) {
        start = -(whole + NEAR * sign(step)) / step;
        start = IS_JITTERED ? start * params.left - offset : start;
        start = ceil(clamp(start - MARGIN, 0.0, last));
    }
    float apart = !IS_JITTERED ? 1.0 : params.left > 0.0 ? 1.0 / params.left : 0.0;
    float at = IS_JITTERED ? (start + offset) * apart : start, less = 1.0 / steps, part = 1.0 - at * less;
    place += at * way;
    way *= apart;
    less *= apart;
    // How many samples are in the surroundings, but for those whose part is rounding.
    int count = int(2.0 * NEAR / max(abs(step) * apart, MIN_STEP) + 1.0 + MARGIN);
    vec4 sums = vec4(0.0);
    [[unroll]] for (int i = 0; i < MAX_SAMPLES; ++i) {
        if (i >= count)
            break;
        vec2 first = max(1.0 - abs(place), vec2(0.0)), second = max(1.0 - abs(place - 1.0), vec2(0.0));
        // Without jitter nothing is left after the last sample.
        float left = IS_JITTERED ? (start + float(i) <= last ? part : 0.0) : max(part, 0.0);
        if (is_at_edge) {
            vec2 inside = cell + 0.5 + place;
            left = all(equal(clamp(inside, vec2(0.0), size), inside)) ? left : 0.0;
        }
        vec2 shares = left * left * vec2(first.y, second.y);
        sums.xy = fma(shares.xx, vec2(first.x, second.x), sums.xy);
        sums.zw = fma(shares.yy, vec2(first.x, second.x), sums.zw);
        place += way;
        part -= less;
    }
    return sums;
}

// Whether the highlights of a texel and their slope are 0: so are those of the pixels in its block (mean_of_texels).
bool is_dark(ivec2 texel, int height)
{
    ivec2 last = textureSize(frame, 0) - 1;
    ivec2 first = ivec2(params.dark_side * texel.x, last.y - params.dark_side * (height - 1 - texel.y));
    bool dark = true;
    for (int y = 0; y < params.dark_side; ++y)
        for (int x = 0; x < params.dark_side; ++x) {
            vec4 pixel = texelFetch(frame, clamp(first + ivec2(x, -y), ivec2(0), last), 0);
            // (NaN is not below.)
            dark = dark && all(lessThan(pixel.rgb, vec3(params.dark_below)));
        }
    return dark;
}

bool is_dark_cell(ivec2 cell)
{
    ivec2 last = textureSize(cotangents, 0) - 1;
    bool dark = THRESHOLDED != 0;
    for (int i = 0; dark && i < BEAM_CELL * BEAM_CELL; ++i)
        dark = is_dark(min(cell + ivec2(i % BEAM_CELL, i / BEAM_CELL), last), last.y + 1);
    return dark;
}

// Of the texels of the cell.
vec4 sums_of_cell[BEAM_CELL * BEAM_CELL];

// Adds up the pixels on one side of the sun, which is the cell's own side or -1: the lines of a group in a range on the
// longer axis, as seen from the sun.
void gather_side(ivec2 cell, vec2 range, float side, int group, int groups)
{
    ivec2 size = textureSize(cotangents, 0);
    vec2 centre = CENTRE, here = vec2(cell) + 0.5 * float(BEAM_CELL - 1) - centre;
    bool along_x = abs(here.x) > abs(here.y), is_near = max(abs(here.x), abs(here.y)) < MIN_LONGER;
    bool is_at_edge = any(equal(cell, ivec2(0))) || any(greaterThanEqual(cell + BEAM_CELL, size));
    // The longer axis, then the other one.
    vec2 own = along_x ? here.xy : here.yx, sun = along_x ? centre.xy : centre.yx;
    ivec2 sides = along_x ? size.xy : size.yx;
    // How far away on the other axis the pixels are for each pixel on the longer axis.
    float longer = abs(own.x), around = NEAR + MARGIN, least = own.y - around, most = own.y + around;
    vec2 slopes = sign(own.x) * vec2(least / (longer + (least > 0.0 ? around : -around)),
                                     most / (longer + (most > 0.0 ? -around : around)));
    vec2 ends = side * own.x > 0.0 ? sun.x + range : sun.x - range.yx;
    ends = clamp(is_near ? sun.x + vec2(-range.y, range.y) : ends, vec2(-1.0), vec2(sides.x));
    int last = min(int(floor(ends.y)), sides.x - 1);
    for (int line = first_of_group(max(int(ceil(ends.x)), 0), group, groups); line <= last; line += groups) {
        vec2 across = (float(line) - sun.x) * slopes;
        across = is_near ? vec2(-range.y, range.y) : vec2(min(across.x, across.y), max(across.x, across.y));
        across = clamp(sun.y + across, vec2(-1.0), vec2(sides.y));
        int end = min(int(floor(across.y)), sides.y - 1), place = max(int(ceil(across.x)), 0);
        vec2 pixel = along_x ? vec2(line, place) : vec2(place, line), next = along_x ? vec2(0.0, 1.0) : vec2(1.0, 0.0);
        for (; place <= end; ++place, pixel += next) {
            vec4 weights = weights_for(pixel, vec2(cell), is_at_edge);
            vec4 value = texelFetch(cotangents, along_x ? ivec2(line, place) : ivec2(place, line), 0);
            [[unroll]] for (int i = 0; i < BEAM_CELL * BEAM_CELL; ++i)
                sums_of_cell[i] = fma(vec4(weights[i]), value, sums_of_cell[i]);
        }
    }
}

void gather_cell(ivec2 cell, int group, int groups)
{
    vec2 here = abs(vec2(cell) + 0.5 * float(BEAM_CELL - 1) - CENTRE);
    float longer = max(here.x, here.y), other = min(here.x, here.y), around = NEAR + MARGIN;
    // How far away a pixel may be from its samples, and these from the sun, beyond it.
    float beyond = !IS_JITTERED ? 0.0 : params.left > 0.0 ? 2.0 / params.left : 2.0;
    float most = params.left > 0.0 ? float(params.most) + 2.0 + beyond : 4.0;
    // The part of a line that is on the longer axis, at most.
    float slope = longer < MIN_LONGER ? 0.0 : max(other - around, 0.0) / (longer + around);
    float part = inversesqrt(1.0 + slope * slope);
    gather_side(cell, vec2(longer - around, longer + around + most * part), 1.0, group, groups);
    if (IS_JITTERED && longer >= MIN_LONGER && longer <= beyond + 2.0 * NEAR)
        gather_side(cell, vec2(0.0, most), -1.0, group, groups);
}

// The texel's cotangents, from the sum.
vec4 end_of(vec4 sum)
{
    // A pixel without weights shows itself.
    if (IS_JITTERED && weights_of(PIXEL, textureSize(cotangents, 0)) == 0.0)
        sum += texelFetch(cotangents, PIXEL, 0);
    return gathered(sum);
}

void main()
{
    ivec2 first = PIXEL, size = imageSize(target);
    if (any(greaterThanEqual(first, size)))
        return;
    [[unroll]] for (int i = 0; i < BEAM_CELL * BEAM_CELL; ++i)
        sums_of_cell[i] = vec4(0.0);
    bool is_partial = PARTIAL_SUMS != 0;
    Gathered own = is_partial ? gathered_at(first) : Gathered(first, 0, 1);
    // Blocks have whole cells.
    bool gathers = is_partial ? own.groups > 0 : number_of_block(first) < 0;
    if (!is_dark_cell(own.texel)) {
        if (gathers)
            gather_cell(own.texel, own.group, own.groups);
        else if (!is_partial)
            [[unroll]] for (int i = 0; i < BEAM_CELL * BEAM_CELL; ++i)
                sums_of_cell[i] = sum_of_groups(first + ivec2(i % BEAM_CELL, i / BEAM_CELL));
    }
    [[unroll]] for (int i = 0; i < BEAM_CELL * BEAM_CELL; ++i) {
        PIXEL = first + ivec2(i % BEAM_CELL, i / BEAM_CELL);
        if (all(lessThan(PIXEL, size)))
            imageStore(target, PIXEL, is_partial ? sums_of_cell[i] : end_of(sums_of_cell[i]));
    }
}
