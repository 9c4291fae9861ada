#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// HDRP's horizontal blur of an image of the target's size (FIRST) or of exactly twice its width, whose
// samples are means of two texels. An invocation has each sample once for all pixels. Without it
// and hdrp_columns.comp `unity_hdrp` takes 104 ms in place of 67 (processor time of 1920 x
// 1080 in float16, lavapipe of Mesa 25.0.7, 2026-11-26).
#include "lib/block.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"
#include "lib/hdrp.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = HDRP_OUTPUTS, ROWS = GATHER_ROWS, SAMPLES = COLUMNS + 2 * HDRP_RADIUS;

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, source);
WRITE_IMAGE(2);

#define LOAD load_same
#define LOAD_IMAGE source
#define LOAD_NUMBER 1
#define LOAD_FROM (-HDRP_RADIUS)
#define LOAD_COUNT SAMPLES
#include "variants/load.glsl"

#define LOAD load_double
#define LOAD_IMAGE source
#define LOAD_NUMBER 1
#define LOAD_FROM (-2 * HDRP_RADIUS)
#define LOAD_COUNT (2 * SAMPLES)
#include "variants/load.glsl"

#define STORE_COUNT COLUMNS
#include "variants/store.glsl"

vec4 samples[SAMPLES];

void take_first(int first, int y)
{
    uvec4 raw[SAMPLES];

    load_same(first, y, raw);
    [[unroll]] for (int i = 0; i < SAMPLES; ++i)
        samples[i] = value_of(raw[i]);
    [[unroll]] for (int i = 0; i < HDRP_RADIUS; ++i)
        samples[i] = first == 0 ? samples[HDRP_RADIUS + (i & 1)] : samples[i];
}

void take_means(int first, int y)
{
    uvec4 raw[2 * SAMPLES];

    load_double(2 * first, y, raw);
    [[unroll]] for (int i = 0; i < SAMPLES; ++i)
        samples[i] = 0.5 * value_of(raw[2 * i]) + 0.5 * value_of(raw[2 * i + 1]);
    // Beyond the last pixel its sample is repeated, not its second texel.
    [[unroll]] for (int i = 1; i < SAMPLES; ++i)
        samples[i] = first - HDRP_RADIUS + i >= target_shape.x ? samples[i - 1] : samples[i];
}

void write_row(int x, int y)
{
    uvec4 pixels[COLUMNS];

    if (FIRST != 0)
        take_first(x, y);
    else
        take_means(x, y);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        vec4 sum = vec4(0.0);
        [[unroll]] for (int tap = 0; tap <= 2 * HDRP_RADIUS; ++tap)
            sum += HDRP_WEIGHTS[tap] * samples[i + tap];
        pixels[i] = buffer_of(sum);
    }
    store(x, y, pixels);
}

#include "variants/rows.glsl"
