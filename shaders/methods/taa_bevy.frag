// Bevy's temporal anti-aliasing (taa.wesl @ 4805ca792c3e). Colours are c / (1 + max(r, g, b)); the last channel is
// the confidence, and 0 where there is no history.
#include "lib/taa.glsl"

vec3 compressed_at(ivec2 at)
{
    vec3 light = light_at(at);
    return light * (1.0 / (1.0 + largest(light)));
}

// Of the nearest of five pixels.
vec2 nearest_motion()
{
    const ivec2 offsets[4] = ivec2[4](ivec2(-2, 2), ivec2(2, 2), ivec2(-2, -2), ivec2(2, -2));
    ivec2 nearest = PIXEL;
    if (DEEP == 0)
        return motion_at(nearest);
    float best = depth_at(nearest);
    for (int i = 0; i < 4; ++i) {
        float other = depth_at(PIXEL + offsets[i]);
        if (other > best) {
            best = other;
            nearest = PIXEL + offsets[i];
        }
    }
    return motion_at(nearest);
}

vec3 constrain(vec3 history)
{
    vec3 around[9], sum = vec3(0.0);
    for (int i = 0; i < 9; ++i) {
        around[i] = to_ycocg(compressed_at(PIXEL + ivec2(i % 3 - 1, i / 3 - 1)));
        sum += around[i];
    }
    vec3 mean = sum / 9.0, deviation = deviation_of(around, 9, mean);
    return clamp(to_rgb(clip_to_box(to_ycocg(history), mean, deviation + 1e-8)), 0.0, 1.0);
}

vec4 shade()
{
    vec3 now = compressed_at(PIXEL);
    float confidence = texelFetch(before, PIXEL, 0).a;
    if (confidence == 0.0)
        return kept(now, 1.0 / params.min_weight);
    vec2 motion = nearest_motion();
    Past past = past_of(motion);
    vec3 history = constrain(sample_cross(past, cubic_at(past.part, 0.5)));
    vec2 pixels = abs(motion) * vec2(textureSize(source, 0));
    bool still = pixels.x < params.still && pixels.y < params.still;
    confidence = still ? confidence + 10.0 : 1.0;
    float weight = min(max(1.0 / confidence, params.min_weight), params.weight);
    if (is_outside(past))
        weight = confidence = 1.0;
    return kept(history * (1.0 - weight) + now * weight, confidence);
}
