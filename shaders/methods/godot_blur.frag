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

// The position from which a sample is read: samples are clamped in pairs.
int paired(int place, int length)
{
    int pair = clamp(place & ~1, 0, max(length - 2, 0));
    return min(pair + (place & 1), length - 1);
}

vec4 read(ivec2 pixel, ivec2 size)
{
    if (DIRECTION == DIRECTION_VERTICAL)
        return texelFetch(source, pixel, 0);
    vec4 value = sample_at(source, place_in(source, pixel, size), vec2(0.0), SAMPLING);
    return dimmed(value);
}

// The part of a colour that glows.
float feedback(vec4 value)
{
    float brightest = max(value.r, max(value.g, value.b));
    // A scale of 0 means a step.
    float t = clamp((brightest - params.threshold) / max(params.threshold_scale, 1e-6), 0.0, 1.0);
    return max(t * t * (3.0 - 2.0 * t), params.glow_bloom);
}

vec4 end(vec4 sum)
{
    if (FIRST == 0)
        return params.strength * sum;
    vec4 value = sum / (1.0 - luminance(sum)) * params.strength;
    // Exposure and cap do not apply to alpha.
    value.rgb *= exp2(params.exposure);
    if (THRESHOLDED != 0)
        value *= feedback(value);
    return mask_value() * vec4(min(value.rgb, vec3(params.luminance_cap)), value.a);
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
