// The horizontal blurs of nine taps: HDRP's, of an image of the target's size (FIRST_LEVEL) or of exactly twice its
// width, whose samples are means of two texels; Godot's, of an image of twice the target's size, whose samples
// are means of 2 x 2 texels, into single floats. An invocation has each sample once for all pixels. Without it
// (and nine_columns.comp) `unity_hdrp` takes 104 ms in place of 67, `godot_4_5` 218 in place of 130 (processor
// time of 1920 x 1080 in float16, lavapipe of Mesa 25.0.7, 2026-11-26).

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/nine.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = NINE_OUTPUTS, ROWS = GATHER_ROWS, TAP_NUMBER = 2 * NINE_RADIUS + 1;
const int SAMPLES = COLUMNS + 2 * NINE_RADIUS;

READ_IMAGE(SLOT_SOURCE, source);

#define LOAD load_same
#define LOAD_FROM (-NINE_RADIUS)
#define LOAD_COUNT SAMPLES
#include "variants/load.glsl"

#define LOAD load_double
#define LOAD_FROM (-2 * NINE_RADIUS)
#define LOAD_COUNT (2 * SAMPLES)
#include "variants/load.glsl"

#include "variants/store.glsl"
#include "variants/store_float.glsl"

vec4 halfway(vec4 a, vec4 b)
{
    return 0.5 * a + 0.5 * b;
}

// The samples of a row, from the one NINE_RADIUS before the first pixel on.
void take_samples(int first, int y, out vec4 samples[SAMPLES])
{
    uvec4 same[SAMPLES], upper[2 * SAMPLES], lower[2 * SAMPLES];

    if (EXACT == EXACT_SAME)
        load_same(first, y, same);
    else
        load_double(2 * first, IS_GODOT ? 2 * y : y, upper);
    if (IS_GODOT)
        load_double(2 * first, 2 * y + 1, lower);
    [[unroll]] for (int i = 0; i < SAMPLES; ++i) {
        samples[i] = EXACT == EXACT_SAME
                       ? value_of(same[i])
                       : halfway(value_of(upper[2 * i]), value_of(upper[2 * i + 1]));
        if (IS_GODOT)
            samples[i] = apply_point(POINT_BEFORE,
                halfway(samples[i], halfway(value_of(lower[2 * i]), value_of(lower[2 * i + 1]))));
    }
    // Beyond the edges the outermost two samples alternate, of HDRP only before the first level. Otherwise the
    // first texel and the last sample are repeated. (The target's width is even for Godot.)
    if (IS_GODOT || EXACT == EXACT_SAME)
        [[unroll]] for (int i = 0; i < NINE_RADIUS; ++i)
            samples[i] = first == 0 ? samples[NINE_RADIUS + (i & 1)] : samples[i];
    const int back = IS_GODOT ? 2 : 1;
    [[unroll]] for (int i = 2; i < SAMPLES; ++i)
        samples[i] = first - NINE_RADIUS + i >= target_shape.x ? samples[i - back] : samples[i];
}

void write_row(int x, int y)
{
    vec4 samples[SAMPLES];
    uvec4 pixels[COLUMNS];

    take_samples(x, y, samples);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        vec4 sum = vec4(0.0);
        [[unroll]] for (int tap = 0; tap < TAP_NUMBER; ++tap)
            sum += nine_weight(tap - NINE_RADIUS) * samples[i + tap];
        pixels[i] = buffer_of(sum);
        if (IS_GODOT)
            store_float(x + i, y, stored(sum));
    }
    if (!IS_GODOT)
        store(x, y, pixels);
}

#include "variants/rows.glsl"
