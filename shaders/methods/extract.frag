#version 450
#extension GL_GOOGLE_include_directive : require
// An image reduced to the size of the bloom buffers, then what of it is bright enough. NaN and
// infinity count as 0 before they can reach a neighbour.
#include "lib/block.glsl"
#include "lib/finite.glsl"
#include "lib/threshold.glsl"

#define TEXEL(value) vec4(finite_or_zero((value).rgb), 1.0)
#include "lib/sampling.glsl"

UNIFORM_BLOCK(EXTRACT_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D image;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

vec4 shade()
{
    Place place = PLACE_IN(image);
    // A flat area at the threshold stays out of the bloom as a whole.
    bool within = THRESHOLD_MODE == THRESHOLD_HARD && SAMPLING == SAMPLING_FETCH;
    vec3 reduced = within ? fetch_within(image, place).rgb
                          : sample_at(image, place, vec2(0.0), SAMPLING).rgb;
    vec3 bright = apply_threshold(reduced, THRESHOLD_MODE, params.threshold, params.knee);
    return vec4(storable(bright), 1.0);
}
