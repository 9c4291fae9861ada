#version 450
#extension GL_GOOGLE_include_directive : require
// A blur by a symmetric kernel, in one direction or, as one N x N pass, in both. The source may
// have another size than the target: the step stays one texel of the source times the scale.
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(BLUR_BLOCK);
#include "lib/storage.glsl"

layout(constant_id = 0) const int DIRECTION = DIRECTION_VERTICAL;
layout(constant_id = 1) const int RADIUS = 4;
layout(constant_id = 2) const int FIRST_TAP = 1;
layout(constant_id = 3) const int STEP_TEXEL = TEXEL_OWN;
layout(constant_id = 4) const int SAMPLING = SAMPLING_FILTER;

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

float weight(int tap)
{
    return params.weights[tap >> 2][tap & 3];
}

// The kernel's value `tap` texels from its centre: the strength does not touch the centre,
// unless the taps start at 0, which adds it twice more (the outline's loop).
float coefficient(int tap)
{
    if (tap != 0)
        return params.blur_strength * weight(tap);
    return weight(0) * (FIRST_TAP == 0 ? 1.0 + 2.0 * params.blur_strength : 1.0);
}

vec3 tap_pair(Place place, vec2 centre, vec2 offset)
{
    return sample_at(source, place, centre + offset, SAMPLING).rgb
         + sample_at(source, place, centre - offset, SAMPLING).rgb;
}

vec3 blur_line(Place place, vec2 centre, vec2 tap_step)
{
    vec3 sum = coefficient(0) * sample_at(source, place, centre, SAMPLING).rgb;
    for (int tap = 1; tap <= RADIUS; ++tap)
        sum += coefficient(tap) * tap_pair(place, centre, float(tap) * tap_step);
    return sum;
}

vec4 shade()
{
    float scale = params.blur_scale * params.layer_scale;
    Place place = PLACE_IN(source);
    vec2 across = vec2(scale, 0.0);
    // In texels of the height, one texel of the width is height / width (`step_ratio`).
    vec2 down = vec2(0.0, STEP_TEXEL == TEXEL_X ? scale * params.step_ratio : scale);
    vec3 sum;
    if (DIRECTION == DIRECTION_VERTICAL) {
        sum = blur_line(place, vec2(0.0), down);
    } else if (DIRECTION == DIRECTION_HORIZONTAL) {
        sum = blur_line(place, vec2(0.0), across);
    } else {
        sum = coefficient(0) * blur_line(place, vec2(0.0), across);
        for (int tap = 1; tap <= RADIUS; ++tap)
            sum += coefficient(tap) * (blur_line(place, float(tap) * down, across)
                                       + blur_line(place, -float(tap) * down, across));
    }
    return vec4(storable(params.layer_strength * sum), 1.0);
}
