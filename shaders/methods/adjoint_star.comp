#version 450
#extension GL_GOOGLE_include_directive : require
// The transpose of Blender's recursive filter (simple_star.comp), from the end of each line: a pixel
// gets the cotangents of the one after it that it was mixed into, complete, and brings them to itself
// and to the one after it.
#include "lib/block.glsl"

UNIFORM_BLOCK(STAR_BLOCK);
#include "lib/star_line.glsl"

layout(local_size_x = ROW_INVOCATIONS) in;
layout(set = 0, binding = 1) uniform sampler2D cotangents;
layout(set = 0, binding = 2) uniform sampler2D added;
layout(set = 0, binding = 4) uniform writeonly image2D target;

void store(ivec2 place, vec4 value)
{
    if (ADD_OWN != 0)
        value += texelFetch(added, place, 0);
    imageStore(target, place, value);
}

void main()
{
    Line line = line_of(int(gl_GlobalInvocationID.x), textureSize(cotangents, 0));
    float own = 1.0 - params.fade, end = 0.5 * params.fade;
    // The cotangents of mixed pixels.
    vec4 mixed[4];

    for (int at = line.count - 1; at >= 0; --at) {
        int slot = at % params.distance;
        ivec2 place = line.first + at * line.towards;
        vec4 cotangent = texelFetch(cotangents, place, 0);
        if (at + params.distance < line.count) {
            cotangent += end * mixed[slot];
            store(place + params.distance * line.towards, own * mixed[slot] + end * cotangent);
        }
        mixed[slot] = cotangent;
    }
    for (int at = 0; at < min(params.distance, line.count); ++at)
        store(line.first + at * line.towards, own * mixed[at]);
}
