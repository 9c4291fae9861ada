// Filters a level that is gathered along rows, at the positions of the pixels of a target of another
// width. The results are floats, in an image of the target's width and of the level's height.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(GATHER_BLOCK);
#include "variants/pixels.glsl"

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, source);

#include "lib/gathered.glsl"
#include "variants/store_float.glsl"

vec4 filter_row(Window window, int line)
{
    int last = read_shapes[0].x - 1;
    vec4 sum = vec4(0.0);
    [[unroll]] for (int i = 0; i < WINDOW; ++i)
        sum += window.weights[i].x
             * load_pixel(source, read_shapes[0], clamp(window.first + i, 0, last), line);
    return sum;
}

void main()
{
    copy_shapes();
    ivec2 source_size = READ_SIZE(source, 1), size = TARGET_SIZE();
    ivec2 first = first_pixel(ivec2(GATHER_COLUMNS, GATHER_ROWS));
    int end = min(first.y + GATHER_ROWS, size.y);
    Window windows[GATHER_COLUMNS];

    if (any(greaterThanEqual(first, size)))
        return;
    [[unroll]] for (int i = 0; i < GATHER_COLUMNS; ++i) {
        Place place = place_in_size(source_size, ivec2(first.x + i, 0), size);
        windows[i] = window_of(axis_x(place, source_size, vec2(1.0)), WINDOW, true);
    }
    for (int y = first.y; y < end; ++y) {
        vec4 sums[GATHER_COLUMNS];
        [[unroll]] for (int i = 0; i < GATHER_COLUMNS; ++i)
            sums[i] = filter_row(windows[i], y);
        [[unroll]] for (int i = 0; i < GATHER_COLUMNS; ++i)
            store_float(first.x + i, y, sums[i]);
    }
}
