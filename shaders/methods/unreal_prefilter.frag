#version 450
#extension GL_GOOGLE_include_directive : require
// three.js' high pass: one bilinear tap, with a smooth step of its luminance (mrdoob/three.js,
// examples/jsm/shaders/LuminosityHighPassShader.js @ 0255e15dd1d4).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"

vec4 shade()
{
    vec4 value = sample_at(source, PLACE_IN(source), vec2(0.0), SAMPLING);
    if (THRESHOLDED != 0) {
        // BloomNode's luminance is that of three.js' colour management.
        const vec3 weights = NODE != 0 ? vec3(0.2126, 0.7152, 0.0722)
                                       : vec3(0.2126729, 0.7151522, 0.0721750);
        float luminance = dot(value.rgb, weights);
        value *= smoothstep(params.threshold, params.threshold + params.smooth_width, luminance);
    }
    return stored(mask_value() * value);
}
