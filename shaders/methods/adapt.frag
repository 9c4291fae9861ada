// Adapts an exposure to what has been metered: the value adapted to, the multiplier before the bloom, the one after
// it, and 1. A call that continues none finds 0 in the last channel.
#include "lib/exposure.glsl"

SAMPLED_IMAGE(SLOT_SOURCE, metered);
SAMPLED_IMAGE(SLOT_EXPOSURE, before);

#include "lib/fullscreen.glsl"

float table_at(int index)
{
    return params.table[index / 4][index % 4];
}

float count_at(int bin)
{
    return texelFetch(metered, ivec2(bin, 0), 0).r;
}

float value_of(int bin)
{
    if (ENGINE == EXPOSURE_PPV2)
        return exp2(18.0 * float(bin) / 128.0 - 9.0);
    if (ENGINE == EXPOSURE_BEVY)
        return float(bin);
    return params.low + float(bin) / 127.0 * (params.high - params.low);
}

// The mean of the bins, without the darkest and the brightest shares of all counts.
float cut_mean(float empty)
{
    bool is_bevy = ENGINE == EXPOSURE_BEVY;
    int bins = is_bevy ? 64 : 128;
    float total = 0.0;
    for (int bin = 0; bin < bins; ++bin)
        total += count_at(bin);
    float low = params.cut_low * total, high = params.cut_high * total;
    if (is_bevy) {
        low = floor(low);
        high = floor(high);
    }
    float end = 0.0, sum = 0.0, weight = 0.0;
    for (int bin = 0; bin < bins; ++bin) {
        float start = end;
        end += count_at(bin);
        float kept = clamp(end, low, high) - clamp(start, low, high);
        // Bevy's darkest bin takes its share, and does not count.
        if (is_bevy && bin == 0)
            continue;
        sum += kept * value_of(bin);
        weight += kept;
    }
    return weight > 0.0 ? sum / weight : empty;
}

vec4 bevy(vec4 last)
{
    float mean = params.low + (params.high - params.low) * cut_mean(0.0) / 63.0;
    float place = saturate((mean - params.table_low) / (params.table_high - params.table_low));
    float value = last.a != 0.0 ? last.r : clamp(0.0, params.low, params.high);
    float distance = table_at(int(255.0 * place)) - mean - value;
    if (distance > 0.0)
        value += min(params.step_down, distance * params.step_down / params.scale);
    else
        value += max(-params.step_up, distance * params.step_up / params.scale);
    return vec4(value, 1.0, exp2(value), 1.0);
}

vec4 hdrp(vec4 last)
{
    float mean;
    if (ENGINE == EXPOSURE_AUTOMATIC) {
        vec4 sums = texelFetch(metered, ivec2(0), 0);
        mean = sums.g > 0.0 ? sums.r / sums.g : 0.0;
    } else
        mean = cut_mean(params.low);
    float target = mean - params.compensation, value = target;
    if (last.a != 0.0)
        value = last.r + (target - last.r) * (target > last.r ? params.step_up : params.step_down);
    float multiplier = last.a != 0.0 ? 1.0 / (1.2 * exp2(last.r)) : 1.0;
    return vec4(limit(value, params.minimum, params.maximum), multiplier, 1.0, 1.0);
}

vec4 ppv2(vec4 last)
{
    float mean = limit(cut_mean(0.0), exp2(params.minimum), exp2(params.maximum));
    float target = params.scale / max(mean, 1e-4), value = target;
    if (last.a != 0.0)
        value = last.r + (target - last.r) * (target > last.r ? params.step_down : params.step_up);
    return vec4(value, value, 1.0, 1.0);
}

vec4 godot(vec4 last)
{
    float mean = texelFetch(metered, ivec2(0), 0).r, value = mean;
    if (last.a != 0.0)
        value = limit(last.r + (mean - last.r) * params.step_up, params.minimum, params.maximum);
    return vec4(value, params.scale / value, 1.0, 1.0);
}

vec4 o3de(vec4 last)
{
    float mean = texelFetch(metered, ivec2(0), 0).r / (float(params.width) * float(params.height));
    float ratio = is_number(mean) ? mean / 0.18 : 1.0;
    float goal = limit(logarithm(ratio), params.minimum, params.maximum);
    float value = last.a != 0.0 ? last.r : 0.0;
    value += (goal - value) * (goal > value ? params.step_up : params.step_down);
    return vec4(value, 1.0, exp2(-value), 1.0);
}

vec4 granite(vec4 last)
{
    float mean = texelFetch(metered, ivec2(0), 0).r / (float(params.width) * float(params.height));
    float goal = is_number(mean) ? limit(mean, params.minimum, params.maximum) : params.minimum;
    float now = last.a != 0.0 ? last.r : 0.0, value = now + (goal - now) * params.step_up;
    return vec4(value, exp2(-now), exp2(now - value), 1.0);
}

// Keys of seconds and stops; the value adapted to is the time.
vec4 keyframed(vec4 last)
{
    float time = last.a != 0.0 ? last.r + params.step_up : 0.0, stops = table_at(1);
    for (int key = 1; key < params.columns; ++key) {
        float start = table_at(2 * key - 2), end = table_at(2 * key);
        float share = saturate((time - start) / (end - start));
        if (time >= start)
            stops = (1.0 - share) * table_at(2 * key - 1) + share * table_at(2 * key + 1);
    }
    return vec4(time, exp2(stops), 1.0, 1.0);
}

vec4 shade()
{
    vec4 last = texelFetch(before, ivec2(0), 0);
    if (ENGINE == EXPOSURE_BEVY)
        return bevy(last);
    if (ENGINE == EXPOSURE_HDRP || ENGINE == EXPOSURE_AUTOMATIC)
        return hdrp(last);
    if (ENGINE == EXPOSURE_PPV2)
        return ppv2(last);
    if (ENGINE == EXPOSURE_GODOT)
        return godot(last);
    if (ENGINE == EXPOSURE_O3DE)
        return o3de(last);
    if (ENGINE == EXPOSURE_GRANITE)
        return granite(last);
    if (ENGINE == EXPOSURE_KEYFRAMED)
        return keyframed(last);
    return vec4(params.minimum, params.scale, 1.0, 1.0);
}
