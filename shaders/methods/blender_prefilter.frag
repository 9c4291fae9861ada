#version 450
#extension GL_GOOGLE_include_directive : require
// The highlights of Blender's Glare node: the part of a colour's brightest channel above the
// threshold, with smooth transitions at both ends (formulas of the compositor of Blender 4.5).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"

// The value that a smooth transition of this width subtracts (minimum) or adds (maximum) at a
// distance from it (Quilez, "Smooth minimum").
float rounding(float distance_to_end, float width)
{
    float h = width > 0.0 ? max(1.0 - abs(distance_to_end) / width, 0.0) : 0.0;
    return 0.25 * h * h * width;
}

// The brightness above the threshold.
float highlight(float value)
{
    float low = params.threshold, range = params.maximum, high = low + range;
    // The widths are limited, so that the transitions stay between 0 and the other end.
    float at_low = min(params.smoothness, min(low, range));
    float at_high = min(params.smoothness, min(high, range));
    float above = value - low;
    float kept = max(above, 0.0) + rounding(above, at_low);
    return min(kept, range) - rounding(kept - range, at_high);
}

vec4 shade()
{
    vec4 value = sample_at(source, PLACE_IN(source), vec2(0.0), SAMPLING);
    if (THRESHOLDED != 0) {
        float brightest = max(value.r, max(value.g, value.b));
        value = brightest > 0.0 ? value * (highlight(brightest) / brightest) : vec4(0.0);
    }
    return stored(mask_value() * value);
}
