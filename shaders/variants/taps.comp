// Downsamplings that are not linear, and the first passes of published methods: their bilinear taps are in a
// window of the source (variants/kept_rows.glsl). Where the sides of the images are in a simple ratio (EXACT), columns
// share texels and taps. Without this `kino` takes 105 ms in place of 65, as fragment shaders 172 (processor time of
// 1920 x 1080 in float16, lavapipe of Mesa 22.3.6, 2026-11-27).
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/prefilters.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = EXACT != 0 ? TAP_COLUMNS(CHANNEL_BYTES) : 4 / CHANNEL_BYTES, ROWS = TAP_ROWS;
const int RATIO = EXACT == EXACT_HALF ? 2 : 1;
const int KEPT = WINDOW;
// A pixel's position in the source is this part of a texel after a texel.
const float PART = EXACT == EXACT_HALF ? 0.5 : 0.0;
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

// The distance of each tap along an axis from the first of its two texels, for a position this part of a texel after
// a texel. Filament's taps are the second and the fourth one.
float[TAPS] parts_of(float part)
{
    FilamentTaps pairs = filament_taps(vec2(part));
    float parts[TAPS];

    [[unroll]] for (int i = 0; i < TAPS; ++i) {
        float distance = GROUPS == GROUPS_HDRP               ? HDRP_STEPS[i]
                       : GROUPS == GROUPS_FILAMENT && i == 1 ? pairs.left.x
                       : GROUPS == GROUPS_FILAMENT && i == 3 ? pairs.right.x
                                                             : float(i - 2);
        parts[i] = (part + distance) - float(texel_before(i));
    }
    return parts;
}

// The numbers of a group's tap along both axes. Filament's place depends on the position, its sign does not.
ivec2 numbers_of(int group)
{
    vec2 place = place_of(group, filament_taps(vec2(0.0)));
    return 2 + ivec2(sign(place)) * mix(ivec2(1), ivec2(2), equal(abs(place), vec2(HDRP_FAR)));
}

// Of each column: its texel, the part after it, and its taps.
int texels[COLUMNS];
float across[COLUMNS], columns[COLUMNS][TAPS];
vec4 rows[SIDE][TAPS * COLUMNS];

// Where the rows have a tap of a column. Taps that are whole texels apart are those of other columns, too.
int slot(int column, int tap)
{
    bool is_shared = EXACT != 0 && GROUPS != GROUPS_HDRP && GROUPS != GROUPS_FILAMENT;
    return (is_shared ? RATIO : TAPS) * column + tap;
}

vec4 blend(vec4 a, vec4 b, float part)
{
    return EXACT == EXACT_SAME && part == 0.0 ? a : blended(a, b, part);
}

void keep_row(int first, int row)
{
    ivec2 last = read_shapes[SLOT_SOURCE].xy - 1;
    int y = clamp(row, 0, last.y);
    uvec4 raw[LOADED];

    [[unroll]] for (int kept = 1; kept < KEPT; ++kept)
        [[unroll]] for (int i = 0; i < TAPS * COLUMNS; ++i)
            rows[kept - 1][i] = rows[kept][i];
    if (EXACT != 0)
        load_run(RATIO * first, y, raw);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        vec4 loaded[SIDE];
        [[unroll]] for (int at = 0; at < SIDE; ++at) {
            uvec4 texel = EXACT != 0 ? raw[RATIO * i + at]
                                     : raw_pixel(source, read_shapes[SLOT_SOURCE], clamp(texels[i] - 2 + at, 0, last.x), y);
            loaded[at] = value_of(FROM_IMAGE != 0 ? finite_bits(texel) : texel);
        }
        [[unroll]] for (int tap = 0; tap < TAPS; ++tap) {
            int at = 2 + texel_before(tap);
            rows[KEPT - 1][slot(i, tap)] = blend(loaded[at], loaded[at + 1], columns[i][tap]);
        }
    }
}

vec4 tap_at(int column, float parts[TAPS], ivec2 numbers)
{
    int row = KEPT / 2 - 1 + texel_before(numbers.y), at = slot(column, numbers.x);
    return blend(rows[row][at], rows[row + 1][at], parts[numbers.y]);
}

vec4 prefiltered(int column, float parts[TAPS], vec2 part)
{
    vec4 found[5] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
    Taps taps;

    if (!are_of_thirteen()) {
        [[unroll]] for (int group = 0; group < 5; ++group)
            if (group < group_count())
                found[group] = tap_at(column, parts, numbers_of(group));
        return made(found, part);
    }
    [[unroll]] for (int i = 0; i < 9; ++i)
        taps.outer[i] = tap_at(column, parts, 2 * ivec2(i % 3, i / 3));
    [[unroll]] for (int i = 0; i < 4; ++i)
        taps.inner[i] = tap_at(column, parts, 1 + 2 * ivec2(i % 2, i / 2));
    return made(group_means(taps), part);
}

void start_columns(ivec2 first)
{
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        Place place = place_in_size(READ_SIZE(SLOT_SOURCE), ivec2(first.x + i, 0), TARGET_SIZE());
        texels[i] = place.texel.x;
        across[i] = EXACT != 0 ? PART : place.part.x;
        columns[i] = parts_of(across[i]);
    }
    [[unroll]] for (int kept = 0; kept < SIDE; ++kept)
        [[unroll]] for (int i = 0; i < TAPS * COLUMNS; ++i)
            rows[kept][i] = vec4(0.0);
}

void write_row(int first, int y, int texel, float part, int phase)
{
    float parts[TAPS] = parts_of(part);
    uvec4 pixels[COLUMNS];

    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        pixels[i] = buffer_of(prefiltered(i, parts, vec2(across[i], part)));
    store(first, y, pixels);
}

#include "variants/kept_rows.glsl"
