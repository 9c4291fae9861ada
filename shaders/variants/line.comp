#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// A blur in one direction with all taps on integer texels. An invocation writes LINE_OUTPUTS pixels
// along the line and loads each texel once for all of them.
#include "lib/block.glsl"

UNIFORM_BLOCK(LINE_BLOCK);
#include "lib/storage.glsl"

layout(local_size_x = ROW_INVOCATIONS) in;
layout(set = 0, binding = 1, SOURCE_FORMAT) uniform readonly image2D source;
layout(set = 0, binding = 2) uniform writeonly image2D target;

const int LOADED = LINE_OUTPUTS + 2 * RADIUS;

ivec2 along()
{
    return DIRECTION == DIRECTION_VERTICAL ? ivec2(0, 1) : ivec2(1, 0);
}

vec4 load(ivec2 pixel, int texels)
{
    ivec2 texel = pixel + (params.origin + texels) * along();
    return imageLoad(source, clamp(texel, ivec2(0), imageSize(source) - 1));
}

void add_short(ivec2 first, inout vec4 sums[LINE_OUTPUTS])
{
    vec4 texels[LOADED];

    [[unroll]] for (int i = 0; i < LOADED; ++i)
        texels[i] = load(first, i - RADIUS);
    [[unroll]] for (int i = 0; i < LINE_OUTPUTS; ++i)
        [[unroll]] for (int tap = 0; tap <= 2 * RADIUS; ++tap)
            sums[i] += params.kernel[tap >> 2][tap & 3] * texels[i + tap];
}

// Adds as many taps at a time as there are outputs, so that all loops have a constant length.
void add_long(ivec2 first, inout vec4 sums[LINE_OUTPUTS])
{
    vec4 texels[2 * LINE_OUTPUTS - 1];

    [[unroll]] for (int i = 0; i < LINE_OUTPUTS - 1; ++i)
        texels[LINE_OUTPUTS + i] = load(first, i - params.radius);
    for (int chunk = 0; chunk <= 2 * params.radius; chunk += LINE_OUTPUTS) {
        [[unroll]] for (int i = 0; i < LINE_OUTPUTS - 1; ++i)
            texels[i] = texels[LINE_OUTPUTS + i];
        [[unroll]] for (int i = 0; i < LINE_OUTPUTS; ++i)
            texels[LINE_OUTPUTS - 1 + i] = load(first, chunk + LINE_OUTPUTS - 1 + i - params.radius);
        [[unroll]] for (int tap = 0; tap < LINE_OUTPUTS; ++tap)
            [[unroll]] for (int i = 0; i < LINE_OUTPUTS; ++i)
                sums[i] += params.kernel[(chunk >> 2) + (tap >> 2)][tap & 3] * texels[i + tap];
    }
}

void write(ivec2 pixel, vec4 sum)
{
    if (all(lessThan(pixel, imageSize(target))))
        imageStore(target, pixel, stored(sum));
}

void main()
{
    ivec2 first = ivec2(gl_GlobalInvocationID.xy) * (along() * (LINE_OUTPUTS - 1) + 1);
    vec4 sums[LINE_OUTPUTS];

    if (any(greaterThanEqual(first, imageSize(target))))
        return;
    [[unroll]] for (int i = 0; i < LINE_OUTPUTS; ++i)
        sums[i] = vec4(0.0);
    if (RADIUS > 0)
        add_short(first, sums);
    else
        add_long(first, sums);
    [[unroll]] for (int i = 0; i < LINE_OUTPUTS; ++i)
        write(first + i * along(), sums[i]);
}
