// Upsampling by any factor from 1 on, along columns, with filters of adjacent texels. An invocation
// writes a strip from top to bottom. It filters each row of the smaller level along the row once, and
// keeps the filtered rows that a pixel needs. The including shader includes sampling.glsl, axis.glsl
// and pixels.glsl, and defines: `smaller`; `own`, an image of the target's size (HAS_OWN: whether it
// is read); and shade(), which computes a pixel from the pixel of `own` and the upsampled sum.

const int COLUMNS = UPSAMPLE_COLUMNS(CHANNEL_BYTES);
// The rows that a pixel needs, and those of them after its own texel.
const int KEPT = 4;
const int AFTER = UPSAMPLE == UPSAMPLE_LINEAR ? 1 : 2;

#include "variants/own.glsl"

#define AXIS_FILTER filter_row
#define AXIS_IMAGE usamplerBuffer image
#define AXIS_TEXEL(at) load_pixel(image, read_shapes[0], clamp(at, 0, read_shapes[0].x - 1), line)
#include "lib/axis_filter.glsl"

Axis axes[COLUMNS];
vec4 rows[KEPT][COLUMNS];

void add_row(int row)
{
    int line = clamp(row, 0, read_shapes[0].y - 1);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        [[unroll]] for (int kept = 1; kept < KEPT; ++kept)
            rows[kept - 1][i] = rows[kept][i];
        rows[KEPT - 1][i] = filter_row(smaller, axes[i], line);
    }
}

// The pairs of rows are added as filter_row() adds those of texels.
vec4 filter_column(Pair first, Pair second, int i)
{
    if (UPSAMPLE == UPSAMPLE_LINEAR)
        return first.weights.x * rows[KEPT - 2][i] + first.weights.y * rows[KEPT - 1][i];
    vec4 sum = first.weights.x * rows[0][i] + first.weights.y * rows[1][i];
    sum += second.weights.x * rows[2][i] + second.weights.y * rows[3][i];
    return sum;
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
    int texel = int(number / divisor) - 1;
    float coarse = params.coarse;
    uvec4 raw[COLUMNS];

    if (any(greaterThanEqual(first, size)))
        return;
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        Place place = place_in_size(level_size, ivec2(first.x + i, 0), size);
        axes[i] = axis_x(place, UPSAMPLE, 0.0, level_size, vec2(1.0));
        raw[i] = uvec4(0);
        [[unroll]] for (int kept = 0; kept < KEPT; ++kept)
            rows[kept][i] = vec4(0.0);
    }
    for (int y = texel + 1 - AFTER; y < texel + AFTER; ++y)
        add_row(y);
    for (int y = first.y; y < end;) {
        add_row(texel + AFTER);
        // A level that is not larger than the target has at least one pixel for each row. llvmpipe
        // runs what a loop contains once more than it must if the condition comes first.
        do {
            Axis axis = Axis(0, float(rest) / float(divisor), UPSAMPLE, 0.0, 0, 1.0);
            Pair upper = axis_pair(axis, 0), lower = axis_pair(axis, 1);
            if (HAS_OWN)
                load_own(first.x, y, raw);
            [[unroll]] for (int i = 0; i < COLUMNS; ++i)
                raw[i] = shade(raw[i], coarse * filter_column(upper, lower, i),
                               ivec2(first.x + i, y));
            store(first.x, y, raw);
            rest += 2u * height;
            ++y;
        } while (rest < divisor && y < end);
        rest -= divisor;
        ++texel;
    }
}
