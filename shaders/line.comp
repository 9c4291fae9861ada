#version 450
#extension GL_GOOGLE_include_directive : require
// A blur in one direction where the source's pixels are the target's. An invocation writes a run of
// LINE_OUTPUTS pixels along the line and loads each texel once for all of them.
#include "block.glsl"

UNIFORM_BLOCK(LINE_BLOCK);
#include "storage.glsl"

layout(constant_id = 0) const int DIRECTION = DIRECTION_VERTICAL;

layout(local_size_x = 8) in;
layout(set = 0, binding = 1, SOURCE_FORMAT) uniform readonly image2D source;
layout(set = 0, binding = 2) uniform writeonly image2D target;

float weight(int texels)
{
    int tap = abs(texels);
    return params.kernel[tap >> 2][tap & 3];
}

void main()
{
    ivec2 along = DIRECTION == DIRECTION_VERTICAL ? ivec2(0, 1) : ivec2(1, 0);
    ivec2 first = ivec2(gl_GlobalInvocationID.xy) * (along * (LINE_OUTPUTS - 1) + 1);
    ivec2 last = imageSize(source) - 1;
    vec3 sums[LINE_OUTPUTS];

    if (any(greaterThanEqual(first, imageSize(target))))
        return;
    for (int i = 0; i < LINE_OUTPUTS; ++i)
        sums[i] = vec3(0.0);
    for (int at = -params.radius; at < params.radius + LINE_OUTPUTS; ++at) {
        ivec2 texel = first + (params.origin + at) * along;
        vec3 value = imageLoad(source, clamp(texel, ivec2(0), last)).rgb;
        for (int i = 0; i < LINE_OUTPUTS; ++i)
            sums[i] += weight(at - i) * value;
    }
    for (int i = 0; i < LINE_OUTPUTS; ++i) {
        ivec2 pixel = first + i * along;
        if (all(lessThan(pixel, imageSize(target))))
            imageStore(target, pixel, vec4(storable(sums[i]), 1.0));
    }
}
