#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// Godot's horizontal blur of an image of exactly twice the target's size, whose samples are means of
// 2 x 2 texels. An invocation has each sample once for all pixels. The target holds single floats. Without it
// `godot_4_5` takes 218 ms in place of 130 (processor time of 1920 x
// 1080 in float16, lavapipe of Mesa 25.0.7, 2026-11-26).
#include "lib/block.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"
#include "lib/godot.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = GODOT_COLUMNS, ROWS = GATHER_ROWS, RADIUS_OF_BLUR = 4;
const int SAMPLES = COLUMNS + 2 * RADIUS_OF_BLUR;

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, source);
WRITE_IMAGE(2);

#define LOAD load_run
#define LOAD_IMAGE source
#define LOAD_NUMBER 1
#define LOAD_FROM (-2 * RADIUS_OF_BLUR)
#define LOAD_COUNT (2 * SAMPLES)
#include "variants/load.glsl"

#include "variants/store_float.glsl"

vec4 middle(vec4 a, vec4 b)
{
    return 0.5 * a + 0.5 * b;
}

// The samples of a row, from the one RADIUS_OF_BLUR before the first pixel on. Beyond the edges the
// outermost two alternate. (The target's width is even.)
void take_samples(int first, int y, out vec4 samples[SAMPLES])
{
    uvec4 upper[2 * SAMPLES], lower[2 * SAMPLES];

    load_run(2 * first, 2 * y, upper);
    load_run(2 * first, 2 * y + 1, lower);
    [[unroll]] for (int i = 0; i < SAMPLES; ++i)
        samples[i] = dimmed(middle(middle(value_of(upper[2 * i]), value_of(upper[2 * i + 1])),
                                   middle(value_of(lower[2 * i]), value_of(lower[2 * i + 1]))));
    [[unroll]] for (int i = 0; i < RADIUS_OF_BLUR; ++i)
        samples[i] = first == 0 ? samples[RADIUS_OF_BLUR + (i & 1)] : samples[i];
    [[unroll]] for (int i = 2; i < SAMPLES; ++i)
        samples[i] = first - RADIUS_OF_BLUR + i >= target_shape.x ? samples[i - 2] : samples[i];
}

void write_row(int x, int y)
{
    vec4 samples[SAMPLES];

    take_samples(x, y, samples);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        vec4 sum = vec4(0.0);
        [[unroll]] for (int tap = -RADIUS_OF_BLUR; tap <= RADIUS_OF_BLUR; ++tap)
            sum += GODOT_WEIGHTS[abs(tap)] * samples[i + RADIUS_OF_BLUR + tap];
        store_float(x + i, y, stored(sum));
    }
}

#include "variants/rows.glsl"
