// What engines share that mix a frame with its history. Light that is not finite counts as 0.

UNIFORM_BLOCK(TAA_BLOCK);

#define TAA_CONSTANT(name, value, spelling, shader) const int name = value;
TAAS(TAA_CONSTANT)

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_HISTORY, before);
SAMPLED_IMAGE(SLOT_MOTION_X, motion_x);
SAMPLED_IMAGE(SLOT_MOTION_Y, motion_y);
SAMPLED_IMAGE(SLOT_DEPTH, depth);

#include "lib/fullscreen.glsl"
#include "lib/sampling.glsl"

// A place in the frame before: a texel, the offset from its centre, and the same in one number.
struct Past {
    ivec2 texel;
    vec2 part, at;
};

bool is_inside(ivec2 at)
{
    return all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, textureSize(source, 0)));
}

vec3 light_at(ivec2 at)
{
    return finite_or_zero(fetch_clamped(source, at).rgb);
}

float depth_at(ivec2 at)
{
    return MOVING == MOTION_PACKED ? fetch_clamped(motion_x, at).b : fetch_clamped(depth, at).r;
}

// Now minus before, in shares of the sides.
vec2 motion_at(ivec2 at)
{
    if (MOVING == MOTION_PACKED)
        return fetch_clamped(motion_x, at).rg;
    return MOVING != 0 ? vec2(fetch_clamped(motion_x, at).r, fetch_clamped(motion_y, at).r) : vec2(0.0);
}

Past past_of(vec2 motion)
{
    vec2 size = vec2(textureSize(source, 0));
    // Beyond the edges all samples are alike.
    vec2 at = clamp(vec2(PIXEL) - motion * size, vec2(-8.0), size + 8.0), first = floor(at);
    return Past(ivec2(first), at - first, at);
}

bool is_outside(Past past)
{
    vec2 end = vec2(textureSize(source, 0)) - 0.5;
    return any(lessThan(past.at, vec2(-0.5))) || any(greaterThan(past.at, end));
}

vec3 to_ycocg(vec3 colour)
{
    return vec3(0.25 * colour.r + 0.5 * colour.g + 0.25 * colour.b, 0.5 * colour.r - 0.5 * colour.b,
                -0.25 * colour.r + 0.5 * colour.g - 0.25 * colour.b);
}

vec3 to_rgb(vec3 colour)
{
    return vec3(colour.x + colour.y - colour.z, colour.x + colour.z, colour.x - colour.y - colour.z);
}

// A cubic filter, whose two middle taps are one sample: the weights of the three samples along both axes, and
// where the middle one is between its texels.
struct Cubic {
    vec2 weights[3];
    vec2 middle;
};

Cubic cubic_at(vec2 part, float c)
{
    vec2 squared = part * part, back = 1.0 - part, back_squared = back * back;
    vec2 first = part * (-c + part * (2.0 * c - c * part));
    vec2 second = 1.0 + squared * (c - 3.0 + (2.0 - c) * part);
    vec2 third = 1.0 + back_squared * (c - 3.0 + (2.0 - c) * back);
    vec2 last = back * (-c + back * (2.0 * c - c * back));
    return Cubic(vec2[3](first, second + third, last), third / (second + third));
}

// The texel and the offset of a sample, 0 to 2 along both axes.
Place sample_place(Past past, Cubic cubic, ivec2 number)
{
    return Place(past.texel + ivec2(number.x == 0 ? -1 : number.x == 1 ? 0 : 2,
                                    number.y == 0 ? -1 : number.y == 1 ? 0 : 2),
                 vec2(number.x == 1 ? cubic.middle.x : 0.0, number.y == 1 ? cubic.middle.y : 0.0));
}

float sample_weight(Cubic cubic, ivec2 number)
{
    return cubic.weights[number.x].x * cubic.weights[number.y].y;
}

vec3 sample_history(Past past, Cubic cubic, ivec2 number)
{
    Place place = sample_place(past, cubic, number);
    return fetch_bilinear(before, place.texel, place.part).rgb * sample_weight(cubic, number);
}

const ivec2 CROSS[5] = ivec2[5](ivec2(1, 0), ivec2(0, 1), ivec2(1, 1), ivec2(2, 1), ivec2(1, 2));

// Without the samples in the corners; the weights of what is there are not 1 together.
vec3 sample_cross(Past past, Cubic cubic)
{
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 5; ++i)
        sum += sample_history(past, cubic, CROSS[i]);
    return sum;
}

float cross_weight(Cubic cubic)
{
    float sum = 0.0;
    for (int i = 0; i < 5; ++i)
        sum += sample_weight(cubic, CROSS[i]);
    return sum;
}

// Pulls a colour along the line to the mean, until it is in the box around that.
vec3 clip_to_box(vec3 colour, vec3 mean, vec3 extent)
{
    vec3 away = colour - mean, part = vec3(0.0);
    for (int i = 0; i < 3; ++i)
        part[i] = away[i] == 0.0 ? 0.0 : abs(away[i]) / extent[i];
    float most = largest(part);
    return most > 1.0 ? mean + away / most : colour;
}

// The standard deviation of some colours from their mean, by channels. Their squares less that of the mean, as engines
// have it, would lose the digits of small ones.
vec3 deviation_of(vec3 around[9], int count, vec3 mean)
{
    vec3 sum = vec3(0.0);
    for (int i = 0; i < count; ++i) {
        vec3 away = around[i] - mean;
        sum += away * away;
    }
    return sqrt(sum / float(count));
}

// Of the frame with this number, and of an offset of -1 to 1 along both axes.
float filter_weight(int number, ivec2 offset)
{
    int index = (offset.y + 1) * 3 + offset.x + 1;
    return params.weights[3 * (number % int(params.phases)) + index / 4][index % 4];
}

// The number after the one of a frame. It stays small, and is not 0.
float next_number(int number)
{
    int phases = int(params.phases), next = number + 1;
    return float(next < 2 * phases ? next : next - phases);
}

vec4 kept(vec3 light, float number)
{
    return vec4(finite_or_zero(light), number);
}
