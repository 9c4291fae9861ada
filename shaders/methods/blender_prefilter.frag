#version 450
#extension GL_GOOGLE_include_directive : require
// The highlights of Blender's Glare node: what a colour's brightest channel has above the threshold,
// with soft ends (formulas of the compositor of Blender 4.5).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"

// What a soft end of that width takes away (min) or adds (max) at a distance from it (Quilez,
// "Smooth minimum").
float rounding(float distance_to_end, float width)
{
    float h = width > 0.0 ? max(1.0 - abs(distance_to_end) / width, 0.0) : 0.0;
    return 0.25 * h * h * width;
}

// The brightness above the threshold.
float highlight(float value)
{
    float low = params.threshold, range = params.maximum, high = low + range;
    // So narrow that nothing of the soft parts lies below 0 or beyond the other end.
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
