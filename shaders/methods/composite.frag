#version 450
#extension GL_GOOGLE_include_directive : require
// The finished picture: scene and bloom, exposure, tone map, encoding, dither.
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(COMPOSITE_BLOCK);
#include "lib/storage.glsl"
#include "lib/composite.glsl"

layout(set = 0, binding = 1) uniform sampler2D scene;
layout(set = 0, binding = 2) uniform sampler2D bloom;
layout(set = 0, binding = 3) uniform sampler2D mask;

#define TARGET_BINDING 4
#include "lib/fullscreen.glsl"

// The bloom from its image; or from the lines of the last blur, rounded as that image would be.
vec4 bloom_light()
{
    if (BLOOM != BLOOM_LINES)
        return texelFetch(bloom, PIXEL, 0);
    bool floats = FORMAT == STORED_HALF || FORMAT == STORED_SINGLE;
    int sampling = floats ? SAMPLING_FETCH : SAMPLING_FILTER;
    vec4 light = sample_bordered(bloom, PIXEL, textureSize(scene, 0), sampling);
    return as_stored(light, FORMAT);
}

vec4 shade()
{
    vec4 light = COMPOSITE == COMPOSITE_OFF ? vec4(0.0) : bloom_light();
    float share = MASKED != 0 ? texelFetch(mask, PIXEL, 0).r : 1.0;
    return finish(texelFetch(scene, PIXEL, 0), light, share, PIXEL);
}
