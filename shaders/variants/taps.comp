// Downsamplings that are not linear, and the first passes of published methods: their bilinear taps are in a
// window of the source (variants/kept_rows.glsl). Where the sides of the images are in a simple ratio (EXACT), columns
// share texels and taps. Without this `kino` takes 105 ms in place of 65, as fragment shaders 172 (processor time of
// 1920 x 1080 in float16, lavapipe of Mesa 22.3.6, 2026-11-27).
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/prefilter.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = EXACT != 0 ? TAP_COLUMNS(CHANNEL_BYTES) : 4 / CHANNEL_BYTES, ROWS = TAP_ROWS;
const int RATIO = EXACT == EXACT_HALF ? 2 : 1;
const int KEPT = WINDOW;
// A pixel's position in the source is this part of a texel after a texel.
const float PART = EXACT == EXACT_HALF ? 0.5 : 0.0;
// The places of taps along an axis, and the texels that they are between, from MAX_PLACE before the position's on.
const int PLACES = 2 * MAX_PLACE + 1, SIDE = PLACES + 1;
const int LOADED = RATIO * COLUMNS + SIDE;

#define LOAD_FROM -MAX_PLACE
#include "variants/runs.glsl"

// The texel at or before a place (from -MAX_PLACE to MAX_PLACE), from the position's on.
int texel_before(int at)
{
    return are_texels() ? at : int(floor(PART + place_along(at, PART)));
}

// The distance of each place along an axis from the first of its two texels, for a position this part of a texel after
// a texel.
float[PLACES] parts_of(float part)
{
    float parts[PLACES];

    [[unroll]] for (int i = 0; i < PLACES; ++i)
        parts[i] = (part + place_along(i - MAX_PLACE, part)) - float(texel_before(i - MAX_PLACE));
    return parts;
}

// Of each column: its texel, the part after it, and its taps.
int texels[COLUMNS];
float across[COLUMNS], columns[COLUMNS][PLACES];
vec4 rows[SIDE][PLACES * COLUMNS];

// Where the rows have a place of a column. Places that are whole texels apart are those of other columns, too.
int slot(int column, int place)
{
    bool is_shared = EXACT != 0 && are_texels();
    return (is_shared ? RATIO : PLACES) * column + place;
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
        [[unroll]] for (int i = 0; i < PLACES * COLUMNS; ++i)
            rows[kept - 1][i] = rows[kept][i];
    if (EXACT != 0)
        load_run(RATIO * first, y, raw);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        vec4 loaded[SIDE];
        [[unroll]] for (int at = 0; at < SIDE; ++at) {
            uvec4 texel = EXACT != 0 ? raw[RATIO * i + at]
                                     : raw_pixel(source, read_shapes[SLOT_SOURCE], clamp(texels[i] - MAX_PLACE + at, 0, last.x), y);
            loaded[at] = value_of(FROM_IMAGE != 0 ? finite_bits(texel) : texel);
        }
        [[unroll]] for (int place = 0; place < PLACES; ++place) {
            int at = MAX_PLACE + texel_before(place - MAX_PLACE);
            rows[KEPT - 1][slot(i, place)] = blend(loaded[at], loaded[at + 1], columns[i][place]);
        }
    }
}

vec4 tap_at(int column, float parts[PLACES], ivec2 at)
{
    int row = KEPT / 2 - 1 + texel_before(at.y), place = slot(column, at.x + MAX_PLACE);
    return blend(rows[row][place], rows[row + 1][place], parts[at.y + MAX_PLACE]);
}

vec4 prefiltered(int column, float parts[PLACES], vec2 part)
{
    vec4 taps[MAX_SET_TAPS];

    [[unroll]] for (int i = 0; i < MAX_SET_TAPS; ++i)
        taps[i] = i < tap_count() ? tap_at(column, parts, numbers_of(i)) : vec4(0.0);
    return prefiltered(taps, part);
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
        [[unroll]] for (int i = 0; i < PLACES * COLUMNS; ++i)
            rows[kept][i] = vec4(0.0);
}

void write_row(int first, int y, int texel, float part, int phase)
{
    float parts[PLACES] = parts_of(part);
    uvec4 pixels[COLUMNS];

    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        pixels[i] = buffer_of(prefiltered(i, parts, vec2(across[i], part)));
    store(first, y, pixels);
}

#include "variants/kept_rows.glsl"
