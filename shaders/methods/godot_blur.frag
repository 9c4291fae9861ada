#version 450
#extension GL_GOOGLE_include_directive : require
// Godot's blur in one direction. The horizontal pass samples the larger image at the level's
// pixels; the vertical pass completes the level (godotengine/godot, copy.glsl @ 0a5efd02df51).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"
#include "lib/godot.glsl"

vec4 read(ivec2 pixel, ivec2 size)
{
    if (DIRECTION == DIRECTION_VERTICAL)
        return texelFetch(source, pixel, 0);
    vec4 value = sample_at(source, place_in(source, pixel, size), vec2(0.0), SAMPLING);
    return dimmed(value);
}

vec4 end(vec4 sum)
{
    return FIRST == 0 ? params.strength * sum : mask_value() * glowing(sum);
}

vec4 shade()
{
    ivec2 size = ivec2(params.target_width, params.target_height);
    vec4 sum = vec4(0.0);
    for (int tap = -4; tap <= 4; ++tap) {
        ivec2 pixel = PIXEL;
        if (DIRECTION == DIRECTION_HORIZONTAL)
            pixel.x = paired(pixel.x + tap, size.x);
        else
            pixel.y = paired(pixel.y + tap, size.y);
        sum += GODOT_WEIGHTS[abs(tap)] * read(pixel, size);
    }
    return stored(DIRECTION == DIRECTION_HORIZONTAL ? sum : end(sum));
}
