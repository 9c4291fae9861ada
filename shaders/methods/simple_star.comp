#version 450
#extension GL_GOOGLE_include_directive : require
// Blender's recursive filter along rows, columns or diagonals: each pixel is mixed with one before it,
// which is mixed already, and one after it (formulas of the compositor of Blender 5.0).
#include "lib/block.glsl"

UNIFORM_BLOCK(STAR_BLOCK);
#include "lib/storage.glsl"
#include "lib/star_line.glsl"

layout(local_size_x = ROW_INVOCATIONS) in;
layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 2) uniform sampler2D before;
layout(set = 0, binding = 3) uniform writeonly image2D target;

vec4 fetch(Line line, int at)
{
    return at >= 0 && at < line.count ? texelFetch(source, line.first + at * line.towards, 0)
                                      : vec4(0.0);
}

void main()
{
    Line line = line_of(int(gl_GlobalInvocationID.x), textureSize(source, 0));
    vec4 mixed[4];

    for (int at = 0; at < line.count; ++at) {
        int slot = at % params.distance;
        vec4 ends = fetch(line, at + params.distance);
        if (at >= params.distance)
            ends += mixed[slot];
        mixed[slot] = stored((1.0 - params.fade) * fetch(line, at) + 0.5 * params.fade * ends);
        ivec2 place = line.first + at * line.towards;
        vec4 value = mixed[slot];
        if (ADD_OWN != 0)
            value = stored(value + texelFetch(before, place, 0));
        imageStore(target, place, value);
    }
}
