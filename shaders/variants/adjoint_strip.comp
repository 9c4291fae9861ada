#pragma compile floats
#pragma compile packed
// The derivatives by an image of its complete bloom: the transpose of strip.comp, for a composite without
// a curve, which is a factor. There are no cotangents beyond the edges, and the texel at an edge also has
// what the taps beyond it have read. `Separable` takes 10 ms backward, and 23 with a pass for each axis and
// the threshold (processor time of 960 x 544 in float32, lavapipe of Mesa 22.3.6, 2026-11-26).
#include "variants/fused_bloom.glsl"
#include "variants/pixels.glsl"

// The source has the cotangents.
#define STRIP_CHANNELS 4
#include "variants/strip.glsl"
READ_IMAGE(2, image);

// The weights of a tap and of all taps beyond it.
float along[STRIP_RADIUS + 1], along_beyond[STRIP_RADIUS + 1];
float row_weights[ROWS][TAPS], column_weights[COLUMNS][TAPS];
// Copies of parameters and of factors (see pixels.glsl).
float threshold, knee, share;
int top;

void start_weights(ivec2 first, ivec2 size)
{
    float exposed = exp2(params.exposure), mixed = COMPOSITE == COMPOSITE_MIX ? params.intensity : 0.0;
    float gain = exposed * (LIT != 0 ? 1.0 : params.intensity);
    float across[STRIP_RADIUS + 1], across_beyond[STRIP_RADIUS + 1];

    threshold = params.threshold;
    knee = params.knee;
    share = exposed * (1.0 - mixed);
    top = first.y - STRIP_RADIUS;
    along_beyond[STRIP_RADIUS] = across_beyond[STRIP_RADIUS] = 0.0;
    [[unroll]] for (int i = STRIP_RADIUS; i >= 0; --i) {
        across[i] = vertical_weight(i);
        along[i] = horizontal_weight(i);
        if (i < STRIP_RADIUS) {
            across_beyond[i] = across_beyond[i + 1] + across[i + 1];
            along_beyond[i] = along_beyond[i + 1] + along[i + 1];
        }
    }
    [[unroll]] for (int row = 0; row < ROWS; ++row)
        [[unroll]] for (int tap = 0; tap < TAPS; ++tap) {
            int y = first.y + row, at = top + row + tap, distance = abs(STRIP_RADIUS - tap);
            float weight = across[distance];
            if (tap >= STRIP_RADIUS)
                weight += y == 0 ? across_beyond[distance] : 0.0;
            if (tap <= STRIP_RADIUS)
                weight += y == size.y - 1 ? across_beyond[distance] : 0.0;
            row_weights[row][tap] = at >= 0 && at < size.y ? gain * weight : 0.0;
        }
}

void start_columns(int x, int width)
{
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        [[unroll]] for (int tap = 0; tap < TAPS; ++tap) {
            int distance = abs(STRIP_RADIUS - tap);
            float weight = along[distance];
            if (tap <= STRIP_RADIUS)
                weight += x + i == distance ? along_beyond[distance] : 0.0;
            if (tap >= STRIP_RADIUS)
                weight += width - 1 - x - i == distance ? along_beyond[distance] : 0.0;
            column_weights[i][tap] = weight;
        }
}

float row_weight(int row, int tap)
{
    return row_weights[row][tap];
}

float column_weight(int column, int tap)
{
    return column_weights[column][tap];
}

// Removes the cotangents of NaN and infinity.
void change_run(int loaded, int at, inout uvec4 run[RUN_WORDS])
{
    if (FINITE != 0)
        return;
    vec4 value = load_floats(image, read_shapes[1], at, top + loaded);
    run[0] = floatBitsToUint(where_finite(uintBitsToFloat(run[0]), value));
}

vec3 added_of(uvec4 raw)
{
    return value_of(raw).rgb;
}

vec3 kept_of(vec3 sum)
{
    return sum;
}

void end_columns(int x, int at, int width, inout vec3 sums[ROWS][COLUMNS])
{
    [[unroll]] for (int row = 0; row < ROWS; ++row)
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            sums[row][i] = x + i >= 0 && x + i < width ? sums[row][i] : vec3(0.0);
}

uvec4 finished_pixel(uvec4 raw, vec3 sum, ivec2 pixel)
{
    ivec4 shape = read_shapes[1];
    vec4 scene = load_floats(image, shape, clamp(pixel.x, 0, shape.x - 1), pixel.y);
    vec4 found = back_through_threshold(finite_or_zero(scene), vec4(sum, 0.0), THRESHOLD_MODE,
                                        threshold, knee);
    return floatBitsToUint(where_finite(found + vec4(vec3(share), 1.0) * value_of(raw), scene));
}
