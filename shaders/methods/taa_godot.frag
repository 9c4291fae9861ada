// Godot's temporal anti-aliasing (taa_resolve.glsl @ 0c64c88a78ca). Colours are c / (1 + c); the last channel is the
// number of frames that the history counts as.
#include "lib/taa.glsl"

SAMPLED_IMAGE(SLOT_LAST_MOTION, last_motion);

vec3 compress(vec3 light)
{
    return light / (1.0 + light);
}

// Of the nearest of 3 x 3 pixels, read one pixel to its upper left, as the engine does.
vec2 nearest_motion()
{
    ivec2 nearest = PIXEL;
    float best = 1.0;
    for (int i = 0; DEEP != 0 && i < 9; ++i) {
        ivec2 at = PIXEL + ivec2(i % 3 - 1, i / 3 - 1);
        float other = depth_at(at);
        if (other < best) {
            best = other;
            nearest = at;
        }
    }
    nearest -= 1;
    return is_inside(nearest) ? motion_at(nearest) : vec2(0.0);
}

// Shortens a difference axis by axis, first at the upper ends of the box.
vec3 clip_by_axes(vec3 away, vec3 extent)
{
    for (int i = 0; i < 3; ++i)
        if (away[i] > extent[i] + 1e-8)
            away *= extent[i] / away[i];
    for (int i = 0; i < 3; ++i)
        if (away[i] < -extent[i] - 1e-8)
            away *= -extent[i] / away[i];
    return away;
}

vec3 constrain(vec3 history, vec2 motion)
{
    vec3 around[9], sum = vec3(0.0), squares = vec3(0.0);
    float total = 0.0;
    for (int i = 0; i < 9; ++i) {
        around[i] = to_ycocg(compress(light_at(PIXEL + ivec2(i % 3 - 1, i / 3 - 1))));
        float weight = 1.0 / (1.0 + around[i].x);
        sum += weight * around[i];
        total += weight;
    }
    vec3 mean = sum / total;
    for (int i = 0; i < 9; ++i) {
        vec3 away = around[i] - mean;
        squares += away * away * (1.0 / (1.0 + around[i].x));
    }
    vec3 deviation = sqrt(squares / total);
    float box = clamp(1188.0 / float(textureSize(source, 0).y), 0.75, 1.0);
    float slow = clamp(1.0 - length(motion) / (128.0 / 1080.0), 0.0, 1.0);
    box *= params.moving_box + (1.0 - params.moving_box) * slow * slow;
    return clamp(to_rgb(mean + clip_by_axes(to_ycocg(history) - mean, box * deviation)), 1e-8, 32767.0);
}

// How much of the history is dropped.
float reset_share(Past past, vec2 motion)
{
    // The integer part, also of negative numbers.
    ivec2 at = ivec2(past.at + 0.5);
    vec2 last = is_inside(at) ? texelFetch(last_motion, at, 0).rg : vec2(0.0);
    float apart = length((last - motion) * vec2(textureSize(source, 0))) - params.disocclusion;
    return clamp((is_outside(past) ? 1.0 : 0.0) + clamp(0.01 * apart, 0.0, 1.0), 0.0, 1.0);
}

float luminance(vec3 colour)
{
    return max(0.299 * colour.r + 0.587 * colour.g + 0.114 * colour.b, 1e-4);
}

vec4 shade()
{
    vec3 light = light_at(PIXEL);
    if (texelFetch(last_motion, PIXEL, 0).a == 0.0)
        return kept(light, 0.0);
    vec2 motion = nearest_motion();
    Past past = past_of(motion);
    Cubic cubic = cubic_at(past.part, 0.5);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 9; ++i)
        sum += sample_history(past, cubic, ivec2(i % 3, i / 3));
    vec3 now = compress(light), history = constrain(compress(max(sum, 0.0)), motion);
    float reset = reset_share(past, motion);
    float count = fetch_bilinear(before, past.texel, past.part).a * (1.0 - reset);
    float one = luminance(now), other = luminance(history);
    float alike = 1.0 - abs(one - other) / max(max(one, other), 1.001);
    float weight = clamp(alike * alike / (count + 1.0) + reset, 0.0, 1.0);
    vec3 mixed = history * (1.0 - weight) + now * weight;
    return kept(mixed / max(1.0 - mixed, exp2(-24.0)), min(count + 1.0, params.frames));
}
