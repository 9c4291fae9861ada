// An iteration of a streak (streaks.frag). The taps of a pass have the same offset at all pixels. So
// an invocation writes a strip from top to bottom, and filters each row of a tap along the row once,
// for the two rows of the target that it is part of. Without it `blender_streaks` takes
// 2,660 ms in place of 240 (processor time of 1920 x
// 1080 in float16, lavapipe of Mesa 25.0.7, 2026-11-26).
#include "lib/sampling.glsl"

UNIFORM_BLOCK(STREAKS_BLOCK);
#include "variants/pixels.glsl"

const int COLUMNS = STREAK_COLUMNS, ROWS = STREAK_ROWS;
// The texels at tap 0 are those of the strip. The others are filtered.
const int TAPS = LEVELS > 2 ? LEVELS : 2, FILTERED = TAPS - 1;

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, source);
READ_IMAGE(2, before);

#define LOAD load_own
#include "variants/load.glsl"

#define LOAD load_before
#define LOAD_IMAGE before
#define LOAD_NUMBER 2
#include "variants/load.glsl"

#include "variants/store.glsl"

vec4 seen(uvec4 raw)
{
    vec4 value = value_of(raw);
    return FIRST != 0 ? part_above(value, params.threshold) : value;
}

// The raw pixels of a row from any place on, 0 outside of the image.
void load_moved(int first, int row, out uvec4 raw[COLUMNS + 1])
{
    ivec4 shape = read_shapes[0];
    int start = clamp(row, 0, shape.y - 1) * shape.z;
    bool is_row = row >= 0 && row < shape.y;
#if CHANNEL_BYTES == 2
    // Two pixels are a word, and the first may be the second one of its word.
    const int COUNT = COLUMNS / 2 + 1;
    uvec2 pixels[2 * COUNT];
    int last = (shape.x - 1) / 2;
    [[unroll]] for (int i = 0; i < COUNT; ++i) {
        uvec4 word = texelFetch(source, start + clamp((first >> 1) + i, 0, last));
        pixels[2 * i] = word.xy;
        pixels[2 * i + 1] = word.zw;
    }
    bool odd = (first & 1) != 0;
    [[unroll]] for (int i = 0; i <= COLUMNS; ++i)
        raw[i] = uvec4(odd ? pixels[i + 1] : pixels[i], 0, 0);
#else
    [[unroll]] for (int i = 0; i <= COLUMNS; ++i)
        raw[i] = texelFetch(source, start + clamp(first + i, 0, shape.x - 1));
#endif
    [[unroll]] for (int i = 0; i <= COLUMNS; ++i)
        raw[i] = is_row && first + i >= 0 && first + i < shape.x ? raw[i] : uvec4(0);
}

void main()
{
    copy_shapes();
    ivec2 size = TARGET_SIZE();
    ivec2 first = first_pixel(ivec2(COLUMNS, ROWS));
    int end = min(first.y + ROWS, size.y);
    ivec2 texels[FILTERED];
    vec2 parts[FILTERED];
    vec4 weights[TAPS], rows[FILTERED][COLUMNS];

    if (any(greaterThanEqual(first, size)))
        return;
    [[unroll]] for (int tap = 0; tap < TAPS; ++tap)
        weights[tap] = params.weights[tap];
    [[unroll]] for (int tap = 0; tap < FILTERED; ++tap) {
        vec2 offset = float(tap + 1) * vec2(params.step_x, params.step_y);
        vec2 integer = floor(offset);
        texels[tap] = first + ivec2(integer);
        parts[tap] = offset - integer;
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            rows[tap][i] = vec4(0.0);
    }
    for (int y = first.y - 1; y < end; ++y) {
        uvec4 raw[COLUMNS], moved[COLUMNS + 1];
        vec4 sums[COLUMNS];
        load_before(first.x, max(y, 0), raw);
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            sums[i] = ADD_OWN != 0 ? value_of(raw[i]) : vec4(0.0);
        load_own(first.x, max(y, 0), raw);
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            sums[i] += weights[0] * seen(raw[i]);
        [[unroll]] for (int tap = 0; tap < FILTERED; ++tap) {
            load_moved(texels[tap].x, texels[tap].y + y - first.y + 1, moved);
            vec4 left = seen(moved[0]);
            [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
                vec4 right = seen(moved[i + 1]);
                vec4 row = blended(left, right, parts[tap].x);
                sums[i] += weights[tap + 1] * blended(rows[tap][i], row, parts[tap].y);
                rows[tap][i] = row;
                left = right;
            }
        }
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            raw[i] = buffer_of(sums[i]);
        if (y >= first.y)
            store(first.x, y, raw);
    }
}
