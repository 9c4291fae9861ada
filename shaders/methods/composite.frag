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

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"

// The bloom from its image, or from the lines that end in it, as that image would give it back.
vec3 bloom_light()
{
    if (BLOOM == BLOOM_OWN)
        return texelFetch(bloom, PIXEL, 0).rgb;
    bool floats = FORMAT == STORED_HALF || FORMAT == STORED_SINGLE;
    int sampling = floats ? SAMPLING_FETCH : SAMPLING_FILTER;
    vec3 light = sample_bordered(bloom, PIXEL, textureSize(scene, 0), sampling).rgb;
    return as_stored(light, FORMAT);
}

vec4 shade()
{
    vec3 light = COMPOSITE == COMPOSITE_OFF ? vec3(0.0) : bloom_light();
    return finish(texelFetch(scene, PIXEL, 0), light, PIXEL);
}
