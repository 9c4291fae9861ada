// The temporal anti-aliasing of Unity HDRP 13 (TemporalAntialiasing.hlsl @ a645acddce97), in three qualities. Colours
// are (Y, Co + b, Cg + b) / (1 + Y), of the low quality light. The last channel counts the frames, and is 0 where
// there is no history: then this frame takes its place.
#include "lib/taa.glsl"

#define BIAS      vec3(0.0, 128.0 / 255.0, 128.0 / 255.0)
#define MAX_LIGHT 65472.0

const ivec2 PLUS[4] = ivec2[4](ivec2(0, 1), ivec2(1, 0), ivec2(-1, 0), ivec2(0, -1));
const ivec2 CORNERS[4] = ivec2[4](ivec2(-1, 1), ivec2(1, -1), ivec2(1, 1), ivec2(-1, -1));

bool is_low()
{
    return ENGINE == TAA_HDRP_LOW;
}

float luma(vec3 colour)
{
    return is_low() ? 0.2126729 * colour.r + 0.7151522 * colour.g + 0.0721750 * colour.b : colour.x;
}

vec3 compress(vec3 light)
{
    if (is_low())
        return light;
    vec3 colour = to_ycocg(light) + BIAS;
    return colour * (1.0 / (1.0 + colour.x));
}

vec3 expand(vec3 colour)
{
    return is_low() ? colour : to_rgb(colour * (1.0 / (1.0 - colour.x)) - BIAS);
}

// A sample, not beyond one texel before the right and the lower edge.
Place limit_place(Place place)
{
    ivec2 size = textureSize(source, 0);
    for (int i = 0; i < 2; ++i) {
        int end = size[i] - 2;
        if (place.texel[i] > end || (place.texel[i] == end && place.part[i] > 0.5)) {
            place.texel[i] = end;
            place.part[i] = 0.5;
        }
    }
    return place;
}

vec3 light_near(Place place)
{
    vec4 four[4];
    for (int i = 0; i < 4; ++i)
        four[i] = vec4(light_at(place.texel + ivec2(i & 1, i >> 1)), 1.0);
    return bilinear(four, place.part).rgb;
}

vec3 fetch_light(ivec2 offset)
{
    return clamp(light_near(limit_place(Place(PIXEL + offset, vec2(0.0)))), 0.0, MAX_LIGHT);
}

vec3 fetch_history(Place place, bool first)
{
    place = limit_place(place);
    return first ? light_near(place) : fetch_bilinear(before, place.texel, place.part).rgb;
}

vec3 filter_history(Past past, bool first)
{
    if (is_low() || params.sharpness == 0.0)
        return fetch_history(Place(past.texel, past.part), first);
    Cubic cubic = cubic_at(past.part, params.sharpness);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 5; ++i) {
        // The right sample is in the upper row.
        ivec2 number = CROSS[i], read = i == 3 ? ivec2(2, 0) : number;
        sum += fetch_history(sample_place(past, cubic, read), first) * sample_weight(cubic, number);
    }
    return sum / cross_weight(cubic);
}

float depth_or_zero(ivec2 at)
{
    return is_inside(at) ? depth_at(at) : 0.0;
}

// Of the nearest of the pixel and four diagonal neighbours. That in the pixel's quad is a sum of differences.
vec2 nearest_motion()
{
    if (DEEP == 0)
        return motion_at(PIXEL);
    ivec2 quad = 2 * (PIXEL & 1) - 1, nearest = ivec2(0);
    float own = depth_at(PIXEL), best = own;
    const ivec2 steps[4] = ivec2[4](ivec2(-1, -1), ivec2(1, 1), ivec2(1, -1), ivec2(-1, 1));
    for (int i = 0; i < 4; ++i) {
        ivec2 offset = quad * steps[i];
        float other = depth_or_zero(PIXEL + offset);
        if (i == 0)
            other = depth_or_zero(PIXEL - ivec2(quad.x, 0)) + depth_or_zero(PIXEL - ivec2(0, quad.y)) - own;
        if (other >= best) {
            best = other;
            nearest = offset;
        }
    }
    return motion_at(PIXEL + nearest);
}

// What this frame tells of a pixel: its colour, filtered or not; the mean of its neighbours; the box for the history.
struct Around {
    vec3 now, average, low, high;
};

// How many deviations the history may be from the mean.
float deviations(float now, float history, vec2 motion)
{
    float contrast = clamp(abs(now - history) / max(0.2, max(now, history)), 0.0, 1.0);
    float part = clamp((contrast - 0.05) / (params.contrast - 0.05), 0.0, 1.0), most = params.flicker;
    if (ENGINE == TAA_HDRP_HIGH) {
        float still = clamp(1.0 - 2.0 * length(motion) * length(vec2(textureSize(source, 0))), 0.0, 1.0);
        most *= 0.8 * (1.0 - still) + 2.25 * still;
    }
    return 1.5 + most * (part * part * (3.0 - 2.0 * part));
}

vec4 shade()
{
    int number = int(texelFetch(before, PIXEL, 0).a);
    vec2 motion = nearest_motion();
    Past past = past_of(motion);
    vec3 history = compress(clamp(filter_history(past, number == 0), 0.0, MAX_LIGHT));

    vec3 centre = compress(fetch_light(ivec2(0))), low = centre, high = centre;
    vec3 now = centre * filter_weight(number, ivec2(0)), sum = vec3(0.0), around[9];
    int count = ENGINE == TAA_HDRP_HIGH ? 8 : 4;
    for (int i = 0; i < count; ++i) {
        ivec2 offset = i < 4 ? PLUS[i] : CORNERS[i - 4];
        vec3 colour = compress(fetch_light(offset));
        now += colour * filter_weight(number, offset);
        sum += colour;
        around[i] = colour;
        low = min(low, colour);
        high = max(high, colour);
    }
    vec3 average = sum * (1.0 / float(count));
    if (ENGINE != TAA_HDRP_HIGH)
        now = centre;
    vec2 end = vec2(textureSize(source, 0)) - 1.0;
    if (any(lessThanEqual(past.at, vec2(0.0))) || any(greaterThanEqual(past.at, end)))
        history = now;
    float before_clip = luma(history);
    if (is_low())
        history = clamp(history, low, high);
    else {
        around[count] = centre;
        vec3 mean = (sum + centre) / float(count + 1), extent = deviation_of(around, count + 1, mean);
        extent *= deviations(luma(now), before_clip, motion);
        history = clip_to_box(history, mean, extent);
        low = mean - extent;
        high = mean + extent;
    }

    vec3 light = expand(now);
    light = clamp(light + max(light - expand(average), 0.0) * params.sharpening, 0.0, MAX_LIGHT);
    now = compress(light);
    float contrast = max(luma(high) - luma(low), 0.0);
    float share = contrast == 0.0 && before_clip == 0.0 ? 0.0 : params.weight / (1.0 + contrast / before_clip);
    float weight = max(min(share, 1.0), 0.03);
    if (is_low()) {
        vec3 mixed = history / (1.0 + luma(history)) * (1.0 - weight) + now / (1.0 + luma(now)) * weight;
        light = mixed / (1.0 - luma(mixed));
    } else
        light = expand(history * (1.0 - weight) + now * weight);
    return kept(clamp(light, 0.0, MAX_LIGHT), next_number(number));
}
