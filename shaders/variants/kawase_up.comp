#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// Dual Kawase's upsampling by any factor from 1 on. An invocation writes a strip from top to bottom.
// It keeps the filtered rows that a pixel needs: for single taps of rows at the distance of the axial
// taps, for pairs of those at that of the diagonal ones, and for axial pairs of its own rows.
#include "lib/block.glsl"
#include "lib/sampling.glsl"
#include "lib/axis.glsl"

UNIFORM_BLOCK(KAWASE_BLOCK);
#include "lib/storage.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = 4 / CHANNEL_BYTES;  // of a word
// A pair of rows at a distance from the position begins in one of two rows.
const int KEPT = 3;

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, smaller);
WRITE_IMAGE(2);

#define STORE_COUNT COLUMNS
#include "variants/store.glsl"

#define AXIS_FILTER filter_row
#define AXIS_IMAGE usamplerBuffer image
#define AXIS_TEXEL(at) load_pixel(image, read_shapes[0], clamp(at, 0, read_shapes[0].x - 1), line)
#include "lib/axis_filter.glsl"

// Filtered rows around a distance from a pixel's row, the last of them texel + first + 2.
struct Rows {
    int first;
    vec4 kept[KEPT][COLUMNS];
};

int texels[COLUMNS];
float parts[COLUMNS];
Rows above_single, below_single, above_pairs, below_pairs, axial;

void add_row(inout Rows rows, int texel, int kind, float tap_step)
{
    int last = read_shapes[0].y - 1, line = clamp(texel + rows.first + 2, 0, last);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        Axis axis = Axis(texels[i], parts[i], kind, tap_step, read_shapes[0].x, 1.0);
        [[unroll]] for (int kept = 1; kept < KEPT; ++kept)
            rows.kept[kept - 1][i] = rows.kept[kept][i];
        rows.kept[KEPT - 1][i] = filter_row(smaller, axis, line);
    }
}

// A pair of rows, as filter_column() of filters in two passes adds it.
vec4 pair_of(Rows rows, Pair pair, int i)
{
    bool next = pair.texel > rows.first;
    return pair.weights.x * (next ? rows.kept[1][i] : rows.kept[0][i])
         + pair.weights.y * (next ? rows.kept[2][i] : rows.kept[1][i]);
}

void main()
{
    read_words();
    ivec2 level_size = READ_SIZE(smaller, 1), size = TARGET_SIZE();
    ivec2 first = first_pixel(ivec2(COLUMNS, UPSAMPLE_ROWS));
    int end = min(first.y + UPSAMPLE_ROWS, size.y);
    // The position as in place_in_rows(), but with a rest in place of a quotient for each row.
    uint height = uint(params.source_height == 0 ? level_size.y : params.source_height);
    uint divisor = 2u * uint(params.target_height);
    uint number = uint(2 * first.y + 1) * height + divisor / 2u + uint(params.row_offset);
    uint rest = number % divisor;
    int texel = int(number / divisor) - 1, at = texel - KEPT;
    float far = params.offset, near = 0.5 * params.offset;
    uvec4 pixels[COLUMNS];

    if (any(greaterThanEqual(first, size)))
        return;
    above_single.first = int(floor(-far));
    below_single.first = int(floor(far));
    above_pairs.first = int(floor(-near));
    below_pairs.first = int(floor(near));
    axial.first = -1;
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        Place place = place_in_size(level_size, ivec2(first.x + i, 0), size);
        texels[i] = place.texel.x;
        parts[i] = place.part.x;
        [[unroll]] for (int kept = 0; kept < KEPT; ++kept)
            above_single.kept[kept][i] = below_single.kept[kept][i] = above_pairs.kept[kept][i] =
                below_pairs.kept[kept][i] = axial.kept[kept][i] = vec4(0.0);
    }
    for (int y = first.y; y < end;) {
        do {
            ++at;
            add_row(above_single, at, UPSAMPLE_LINEAR, 0.0);
            add_row(below_single, at, UPSAMPLE_LINEAR, 0.0);
            add_row(above_pairs, at, UPSAMPLE_PAIR, near);
            add_row(below_pairs, at, UPSAMPLE_PAIR, near);
            add_row(axial, at, UPSAMPLE_PAIR, far);
        } while (at < texel);
        // As in upsample.glsl.
        do {
            Axis axis = Axis(0, float(rest) / float(divisor), UPSAMPLE_LINEAR, 0.0, 0, 1.0);
            Pair one = linear_pair(axis, 0.0, 1.0);
            Pair above = linear_pair(axis, -far, 1.0), below = linear_pair(axis, far, 1.0);
            Pair upper = linear_pair(axis, -near, 1.0), lower = linear_pair(axis, near, 1.0);
            [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
                vec4 sum = pair_of(axial, one, i)
                         + (pair_of(above_single, above, i) + pair_of(below_single, below, i));
                sum += 2.0 * (pair_of(above_pairs, upper, i) + pair_of(below_pairs, lower, i));
                pixels[i] = buffer_of(sum / 12.0);
            }
            store(first.x, y, pixels);
            rest += 2u * height;
            ++y;
        } while (rest < divisor && y < end);
        rest -= divisor;
        ++texel;
    }
}
