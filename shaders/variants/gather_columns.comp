// Adds up levels of several sizes that gather_rows.comp has filtered along rows: filters each along
// columns and multiplies it by its weight. With ADDS_IMAGE the first one has the target's size and needs
// no filter. As one fragment shader `godot_4_5` takes 475 ms in place of 130 (processor time of 1920 x
// 1080 in float16, lavapipe of Mesa 25.0.7, 2026-11-26).
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FILTER_BLOCK);
#include "lib/gathered.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = TEXEL_COLUMNS(CHANNEL_BYTES), ROWS = GATHER_ROWS;

READ_IMAGE(SLOT_LEVELS + 0, level_0);
READ_IMAGE(SLOT_LEVELS + 1, level_1);
READ_IMAGE(SLOT_LEVELS + 2, level_2);
READ_IMAGE(SLOT_LEVELS + 3, level_3);
READ_IMAGE(SLOT_LEVELS + 4, level_4);
READ_IMAGE(SLOT_LEVELS + 5, level_5);
READ_IMAGE(SLOT_LEVELS + 6, level_6);

#include "variants/store.glsl"

// The position of a row of the target in an image of this size.
Axis row_axis(ivec2 size, int y)
{
    ivec2 target_size = ivec2(params.target_width, params.target_height);
    return axis_of(place_in_size(size, ivec2(0, y), target_size), size, vec2(1.0), 1);
}

vec4 sums[COLUMNS];

void add_first_level(int first, int y)
{
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        sums[i] += params.shares[0][0] * value_of(raw_in_run(level_0, read_shapes[SLOT_LEVELS], first, i, y));
}

void add(usamplerBuffer image, int level, int first, int y)
{
    if (level >= LEVELS)
        return;
    ivec4 shape = read_shapes[SLOT_LEVELS + level];
    Window window = window_of(row_axis(shape.xy, y), WINDOW, false);
    float weight = params.shares[level >> 2][level & 3];
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        vec4 sum = vec4(0.0);
        [[unroll]] for (int row = 0; row < WINDOW; ++row)
            sum += window.weights[row].x * load_floats(image, shape, first + i, window.first + row);
        sums[i] += weight * sum;
    }
}

void write_row(int x, int y)
{
    uvec4 raw[COLUMNS];

    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        sums[i] = vec4(0.0);
    if (ADDS_IMAGE != 0)
        add_first_level(x, y);
    else
        add(level_0, 0, x, y);
    add(level_1, 1, x, y);
    add(level_2, 2, x, y);
    add(level_3, 3, x, y);
    add(level_4, 4, x, y);
    add(level_5, 5, x, y);
    add(level_6, 6, x, y);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        raw[i] = buffer_of(sums[i]);
    store(x, y, raw);
}

#include "variants/rows.glsl"
