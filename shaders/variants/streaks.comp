// An iteration of a streak (streaks.frag). The taps of a pass have the same offset at all pixels. So
// an invocation writes a strip from top to bottom, and filters each row of a tap along the row once,
// for the two rows of the target that it is part of. Without it `blender_streaks` takes
// 2,660 ms in place of 240 (processor time of 1920 x 1080 in float16, lavapipe of Mesa 25.0.7, 2026-11-26).
#include "lib/sampling.glsl"

UNIFORM_BLOCK(STREAKS_BLOCK);
#include "variants/pixels.glsl"

const int COLUMNS = STREAK_COLUMNS, ROWS = STREAK_ROWS;
// The texels at tap 0 are those of the strip. The others are filtered.
const int RAY_TAPS = TAP_COUNT > 2 ? TAP_COUNT : 2, FILTERED = RAY_TAPS - 1;

READ_IMAGE(SLOT_SOURCE, source);
READ_IMAGE(SLOT_BEFORE, before);

#include "variants/store.glsl"

vec4 seen(uvec4 raw)
{
    vec4 value = value_of(raw);
    return PART_ABOVE != 0 ? part_above(value, params.threshold) : value;
}

// The pixels of a row from any place on, 0 outside of the image.
void load_moved(int first, int row, out uvec4 raw[COLUMNS + 1])
{
    ivec4 shape = read_shapes[SLOT_SOURCE];
    ivec2 last = shape.xy - 1;
    [[unroll]] for (int i = 0; i <= COLUMNS; ++i)
        raw[i] = raw_pixel(source, shape, clamp(first + i, 0, last.x), clamp(row, 0, last.y));
    [[unroll]] for (int i = 0; i <= COLUMNS; ++i)
        raw[i] = clamp(ivec2(first + i, row), ivec2(0), last) == ivec2(first + i, row) ? raw[i] : uvec4(0);
}

void write_block(ivec2 first, int end)
{
    ivec2 texels[FILTERED];
    vec2 parts[FILTERED];
    vec4 weights[RAY_TAPS], rows[FILTERED][COLUMNS];

    [[unroll]] for (int tap = 0; tap < RAY_TAPS; ++tap)
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
        [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
            sums[i] = vec4(0.0);
            if (ADDS_IMAGE != 0)
                sums[i] = value_of(raw_in_run(before, read_shapes[SLOT_BEFORE], first.x, i, max(y, 0)));
            sums[i] += weights[0] * seen(raw_in_run(source, read_shapes[SLOT_SOURCE], first.x, i, max(y, 0)));
        }
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

#include "variants/blocks.glsl"
