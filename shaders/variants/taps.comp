// Downsamplings that are not linear, and the first passes of published methods: their bilinear taps are in a
// window of the source. An invocation writes a strip from top to bottom. It has each row's taps once, and keeps
// those of the rows that a pixel needs. Where the sides of the images are in a simple ratio (EXACT), columns share
// texels and taps. Without it `kino` takes 157 ms in place of 43, `bevy_natural` 89 in place of 54 (processor time of
// 1920 x 1080 in float16, lavapipe of Mesa 22.3.6, 2026-11-27).
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/prefilters.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = EXACT != 0 ? TAP_COLUMNS(CHANNEL_BYTES) : 4 / CHANNEL_BYTES, ROWS = TAP_ROWS;
const int RATIO = EXACT == EXACT_HALF ? 2 : 1;
// A pixel's position in the source: a texel, and what is after it. WINDOW rows are kept, the last of them AFTER it.
const float PART = EXACT == EXACT_HALF ? 0.5 : 0.0;
const int AFTER = WINDOW / 2;
// The taps along an axis, and the texels that they are between, from 2 before the position's on.
const int TAPS = 5, SIDE = TAPS + 1;
const int LOADED = RATIO * COLUMNS + SIDE;

#define LOAD_FROM -2
#include "variants/runs.glsl"

// The distances of HDRP's taps along an axis. Those of other methods are whole texels, but for Filament's.
const float HDRP_STEPS[TAPS] = float[](-HDRP_FAR, -HDRP_NEAR, 0.0, HDRP_NEAR, HDRP_FAR);

// The texel at or before a tap, from the position's on.
int texel_before(int tap)
{
    return GROUPS == GROUPS_HDRP ? int(floor(PART + HDRP_STEPS[tap])) : tap - 2;
}

// The distance of each tap along an axis from the first of its two texels.
struct Line {
    float parts[TAPS];
};

// The taps of a position this part of a texel after a texel. Filament's are the second and the fourth one.
Line line_of(float part)
{
    Line line;

    [[unroll]] for (int i = 0; i < TAPS; ++i) {
        float distance = GROUPS == GROUPS_HDRP ? HDRP_STEPS[i] : float(i - 2);
        line.parts[i] = (part + distance) - float(texel_before(i));
    }
    if (GROUPS == GROUPS_FILAMENT) {
        FilamentTaps taps = filament_taps(vec2(part));
        line.parts[1] = (part + taps.left.x) + 1.0;
        line.parts[3] = (part + taps.right.x) - 1.0;
    }
    return line;
}

// The numbers of a group's tap along both axes. Filament's place depends on the position, its sign does not.
ivec2 numbers_of(int group)
{
    vec2 place = place_of(group, filament_taps(vec2(0.0)));
    return 2 + ivec2(sign(place)) * mix(ivec2(1), ivec2(2), equal(abs(place), vec2(HDRP_FAR)));
}

// Of each column: its texel, and its taps.
int texels[COLUMNS];
Line columns[COLUMNS];
vec4 rows[SIDE][TAPS * COLUMNS];

// Where the rows have a tap of a column. Taps that are whole texels apart are those of other columns, too.
int slot(int column, int tap)
{
    if (EXACT == 0)
        return TAPS * column + tap;
    if (GROUPS == GROUPS_HDRP)
        return TAPS * column + tap;
    return GROUPS == GROUPS_FILAMENT ? TAPS * column + tap : RATIO * column + tap;
}

vec4 blend(vec4 a, vec4 b, float part)
{
    return EXACT == EXACT_SAME && part == 0.0 ? a : blended(a, b, part);
}

void add_row(int first, int row)
{
    ivec2 last = read_shapes[0].xy - 1;
    int y = clamp(row, 0, last.y);
    uvec4 raw[LOADED];

    [[unroll]] for (int kept = 1; kept < WINDOW; ++kept)
        [[unroll]] for (int i = 0; i < TAPS * COLUMNS; ++i)
            rows[kept - 1][i] = rows[kept][i];
    if (EXACT != 0)
        load_run(RATIO * first, y, raw);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        vec4 loaded[SIDE];
        [[unroll]] for (int at = 0; at < SIDE; ++at) {
            uvec4 texel = EXACT != 0 ? raw[RATIO * i + at]
                                     : raw_pixel(source, read_shapes[0], clamp(texels[i] - 2 + at, 0, last.x), y);
            loaded[at] = value_of(FROM_IMAGE != 0 ? finite_bits(texel) : texel);
        }
        [[unroll]] for (int tap = 0; tap < TAPS; ++tap) {
            int at = 2 + texel_before(tap);
            rows[WINDOW - 1][slot(i, tap)] = blend(loaded[at], loaded[at + 1], columns[i].parts[tap]);
        }
    }
}

vec4 tap_at(int column, Line line, ivec2 numbers)
{
    int row = AFTER - 1 + texel_before(numbers.y), at = slot(column, numbers.x);
    return blend(rows[row][at], rows[row + 1][at], line.parts[numbers.y]);
}

vec4 prefiltered(int column, Line line, vec2 part)
{
    vec4 found[5] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
    Taps taps;

    if (!are_of_thirteen()) {
        [[unroll]] for (int group = 0; group < 5; ++group)
            if (group < group_count())
                found[group] = tap_at(column, line, numbers_of(group));
        return made(found, part);
    }
    [[unroll]] for (int i = 0; i < 9; ++i)
        taps.outer[i] = tap_at(column, line, 2 * ivec2(i % 3, i / 3));
    [[unroll]] for (int i = 0; i < 4; ++i)
        taps.inner[i] = tap_at(column, line, 1 + 2 * ivec2(i % 2, i / 2));
    return made(group_means(taps), part);
}

void main()
{
    copy_shapes();
    ivec2 source_size = READ_SIZE(source, 1), size = TARGET_SIZE();
    ivec2 first = first_pixel(ivec2(COLUMNS, ROWS));
    int end = min(first.y + ROWS, size.y);
    // The position as in place_in_size(), but with a rest in place of a quotient for each row.
    uint height = uint(source_size.y);
    uint divisor = 2u * uint(params.target_height);
    uint number = uint(2 * first.y + 1) * height + divisor / 2u;
    uint rest = number % divisor + uint(WINDOW) * divisor;
    int row = int(number / divisor) - 1 + AFTER - WINDOW;
    float across[COLUMNS];
    uvec4 pixels[COLUMNS];

    if (any(greaterThanEqual(first, size)))
        return;
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        Place place = place_in_size(source_size, ivec2(first.x + i, 0), size);
        texels[i] = place.texel.x;
        across[i] = EXACT != 0 ? PART : place.part.x;
        columns[i] = line_of(across[i]);
    }
    [[unroll]] for (int kept = 0; kept < SIDE; ++kept)
        [[unroll]] for (int i = 0; i < TAPS * COLUMNS; ++i)
            rows[kept][i] = vec4(0.0);
    for (int y = EXACT != 0 ? first.y + 1 - WINDOW / RATIO : first.y; y < end; ++y) {
        if (EXACT != 0)
            [[unroll]] for (int i = 1; i <= RATIO; ++i)
                add_row(first.x, RATIO * (y - 1) + AFTER + i);
        // A level that is not larger than the source has at least one row for each pixel. llvmpipe
        // runs what a loop contains once more than it must if the condition comes first.
        else if (ENLARGED == 0 || rest >= divisor)
            do {
                add_row(first.x, ++row);
                rest -= divisor;
            } while (rest >= divisor);
        if (y < first.y)
            continue;
        float down = EXACT != 0 ? PART : float(rest) / float(divisor);
        Line line = line_of(down);
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            pixels[i] = buffer_of(prefiltered(i, line, vec2(across[i], down)));
        store(first.x, y, pixels);
        rest += 2u * height;
    }
}
