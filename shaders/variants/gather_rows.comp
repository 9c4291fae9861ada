// Filters a level that is gathered along rows, at the positions of the pixels of a target of another
// width. The results are floats, in an image of the target's width and of the level's height.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FILTER_BLOCK);
#include "variants/pixels.glsl"

const int COLUMNS = GATHER_COLUMNS, ROWS = GATHER_ROWS;

READ_IMAGE(SLOT_SOURCE, source);

#include "lib/gathered.glsl"
#include "variants/store_float.glsl"

vec4 filter_row(Window window, int line)
{
    int last = read_shapes[SLOT_SOURCE].x - 1;
    vec4 sum = vec4(0.0);
    [[unroll]] for (int i = 0; i < WINDOW; ++i)
        sum += window.weights[i].x
             * load_pixel(source, read_shapes[SLOT_SOURCE], clamp(window.first + i, 0, last), line);
    return sum;
}

void write_block(ivec2 first, int end)
{
    ivec2 source_size = READ_SIZE(SLOT_SOURCE);
    Window windows[COLUMNS];

    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        Place place = place_in_size(source_size, ivec2(first.x + i, 0), TARGET_SIZE());
        windows[i] = window_of(axis_of(place, source_size, vec2(1.0), 0), WINDOW, true);
    }
    for (int y = first.y; y < end; ++y) {
        vec4 sums[COLUMNS];
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            sums[i] = filter_row(windows[i], y);
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            store_float(first.x + i, y, sums[i]);
    }
}

#include "variants/blocks.glsl"
