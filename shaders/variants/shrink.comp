#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The first passes of published methods that read an image of any other size, with bilinear taps one
// texel or two apart. An invocation writes a strip from top to bottom. It has each row's taps once,
// and keeps those of the rows that a pixel needs. Without it `bevy_natural` takes 104 ms
// in place of 72 (processor time of 1920 x
// 1080 in float16, lavapipe of Mesa 25.0.7, 2026-11-26).
#include "lib/block.glsl"
#include "lib/sampling.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"
#include "lib/prefilters.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = 4 / CHANNEL_BYTES;  // of a word
// The taps along an axis, and the rows that they need: those from a pixel's texel - 2 to + 3, or from
// - 1 to + 2.
const int TAPS = 5, KEPT = 6;
const bool FOUR_TAPS = GROUPS == GROUPS_FILAMENT;
const int AFTER = FOUR_TAPS ? 2 : 3;

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, source);
WRITE_IMAGE(2);

#define STORE_COUNT COLUMNS
#include "variants/store.glsl"

// The distance of each tap along an axis from the first of its two texels.
struct Line {
    float parts[TAPS];
};

// The taps of a position this part of a texel after a texel, between the texels at -2 .. 3: at -2, -1,
// 0, 1 and 2, or for Filament in the second and in the fourth place.
Line line_of(float part)
{
    Line line;

    [[unroll]] for (int i = 0; i < TAPS; ++i) {
        float distance = float(i - 2);
        line.parts[i] = (part + distance) - distance;
    }
    if (FOUR_TAPS) {
        FilamentTaps taps = filament_taps(vec2(part));
        line.parts[1] = (part + taps.left.x) + 1.0;
        line.parts[3] = (part + taps.right.x) - 1.0;
    }
    return line;
}

int texels[COLUMNS];
Line columns[COLUMNS];
vec4 rows[KEPT][COLUMNS][TAPS];

vec4 texel_at(int x, int y)
{
    uvec4 raw = raw_pixel(source, read_shapes[0], clamp(x, 0, read_shapes[0].x - 1), y);
    return value_of(FROM_IMAGE != 0 ? finite_bits(raw) : raw);
}

void add_row(int row)
{
    int y = clamp(row, 0, read_shapes[0].y - 1);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        vec4 loaded[TAPS + 1];
        [[unroll]] for (int kept = 1; kept < KEPT; ++kept)
            rows[kept - 1][i] = rows[kept][i];
        [[unroll]] for (int tap = 0; tap <= TAPS; ++tap)
            loaded[tap] = texel_at(texels[i] - 2 + tap, y);
        [[unroll]] for (int tap = 0; tap < TAPS; ++tap)
            rows[KEPT - 1][i][tap] =
                blended(loaded[tap], loaded[tap + 1], columns[i].parts[tap]);
    }
}

// A tap of a column, by its numbers along both axes. The last row kept is that at AFTER.
vec4 tap(int i, Line line, int x, int y)
{
    int row = KEPT - 1 - AFTER + y - 2;
    return blended(rows[row][i][x], rows[row + 1][i][x], line.parts[y]);
}

vec4 prefiltered(int i, Line line, vec4 shares)
{
    if (FOUR_TAPS)
        return made(vec4[](tap(i, line, 1, 1), tap(i, line, 3, 1), tap(i, line, 1, 3),
                           tap(i, line, 3, 3), vec4(0.0)), shares);
    Taps taps;
    [[unroll]] for (int y = 0; y < 3; ++y)
        [[unroll]] for (int x = 0; x < 3; ++x)
            taps.outer[3 * y + x] = tap(i, line, 2 * x, 2 * y);
    [[unroll]] for (int y = 0; y < 2; ++y)
        [[unroll]] for (int x = 0; x < 2; ++x)
            taps.inner[2 * y + x] = tap(i, line, 2 * x + 1, 2 * y + 1);
    return bevy_prefiltered(taps);
}

void main()
{
    copy_shapes();
    ivec2 source_size = READ_SIZE(source, 1), size = TARGET_SIZE();
    ivec2 first = first_pixel(ivec2(COLUMNS, SHRINK_ROWS));
    int end = min(first.y + SHRINK_ROWS, size.y);
    // The position as in place_in_size(), but with a rest in place of a quotient for each row.
    uint height = uint(source_size.y);
    uint divisor = 2u * uint(params.target_height);
    uint number = uint(2 * first.y + 1) * height + divisor / 2u;
    uint rest = number % divisor + uint(KEPT) * divisor;
    int row = int(number / divisor) - 1 + AFTER - KEPT;
    float across[COLUMNS];
    uvec4 pixels[COLUMNS];

    if (any(greaterThanEqual(first, size)))
        return;
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        Place place = place_in_size(source_size, ivec2(first.x + i, 0), size);
        texels[i] = place.texel.x;
        across[i] = place.part.x;
        columns[i] = line_of(place.part.x);
        [[unroll]] for (int kept = 0; kept < KEPT; ++kept)
            [[unroll]] for (int tap = 0; tap < TAPS; ++tap)
                rows[kept][i][tap] = vec4(0.0);
    }
    for (int y = first.y; y < end; ++y) {
        // A level that is not larger than the source has at least one row for each pixel. llvmpipe
        // runs what a loop contains once more than it must if the condition comes first.
        if (ENLARGED == 0 || rest >= divisor)
            do {
                add_row(++row);
                rest -= divisor;
            } while (rest >= divisor);
        float down = float(rest) / float(divisor);
        Line line = line_of(down);
        [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
            vec4 shares = filament_taps(vec2(across[i], down)).shares;
            pixels[i] = buffer_of(prefiltered(i, line, shares));
        }
        store(first.x, y, pixels);
        rest += 2u * height;
    }
}
