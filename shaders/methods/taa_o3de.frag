// O3DE's temporal anti-aliasing (Taa.azsl @ 354a2accd2a2). The last channel counts the frames. What is outside of the
// frame is 0, depth and motion, too.
#include "lib/taa.glsl"

// The pixel, a cross, the corners.
const ivec2 OFFSETS[9] = ivec2[9](ivec2(0, 0), ivec2(1, 0), ivec2(0, -1), ivec2(-1, 0), ivec2(0, 1), ivec2(1, -1),
                                  ivec2(1, 1), ivec2(-1, -1), ivec2(-1, 1));

// Of the nearest of 3 x 3 pixels.
vec2 nearest_motion()
{
    ivec2 nearest = PIXEL;
    float best = 1.0;
    for (int i = 0; DEEP != 0 && i < 9; ++i) {
        ivec2 at = PIXEL + OFFSETS[i];
        float other = is_inside(at) ? depth_at(at) : 0.0;
        if (other < best) {
            best = other;
            nearest = at;
        }
    }
    return is_inside(nearest) ? motion_at(nearest) : vec2(0.0);
}

vec3 filter_history(Past past)
{
    vec4 four[4] = fetch_four(before, past.texel);
    float low = min(min(four[0].g, four[1].g), min(four[2].g, four[3].g));
    float high = max(max(four[0].g, four[1].g), max(four[2].g, four[3].g));
    Cubic cubic = cubic_at(past.part, 0.5 / (1.0 + high - low));
    return to_ycocg(sample_cross(past, cubic) / cross_weight(cubic));
}

vec4 shade()
{
    int number = int(texelFetch(before, PIXEL, 0).a);
    vec3 around[9], now = vec3(0.0), sum = vec3(0.0);
    for (int i = 0; i < 9; ++i) {
        ivec2 at = PIXEL + OFFSETS[i];
        around[i] = is_inside(at) ? to_ycocg(light_at(at)) : vec3(0.0);
        sum += around[i];
        now += around[i] * filter_weight(number, OFFSETS[i]);
    }
    vec3 mean = sum / 9.0, deviation = params.gamma * deviation_of(around, 9, mean);
    Past past = past_of(nearest_motion());
    vec3 away = filter_history(past) - mean;
    float part = 1.0;
    for (int i = 0; i < 3; ++i)
        part = away[i] == 0.0 ? part : min(part, deviation[i] / abs(away[i]));
    vec3 history = mean + away * part;
    float apart = abs(history.x - now.x);
    float share = apart == 0.0 ? 1.0 : min(params.damping * deviation.x / apart, 1.0);
    float weight = is_outside(past) ? 1.0 : params.weight * share * share;
    return kept(max(to_rgb(history * (1.0 - weight) + now * weight), 0.0), next_number(number));
}
