#version 450
#extension GL_GOOGLE_include_directive : require
// The finished picture: scene and bloom, exposure, tone map, encoding.
#include "block.glsl"

UNIFORM_BLOCK(COMPOSITE_BLOCK);
#include "storage.glsl"
#include "composite.glsl"

layout(constant_id = 0) const int COMPOSITE = COMPOSITE_ADD;
layout(constant_id = 1) const int TONEMAP = TONEMAP_NONE;
layout(constant_id = 2) const int ENCODING = ENCODING_NONE;

layout(set = 0, binding = 1) uniform sampler2D scene;
layout(set = 0, binding = 2) uniform sampler2D bloom;

#define TARGET_BINDING 3
#include "fullscreen.glsl"

vec4 shade()
{
    vec3 light = COMPOSITE == COMPOSITE_OFF ? vec3(0.0) : texelFetch(bloom, PIXEL, 0).rgb;
    return finish(texelFetch(scene, PIXEL, 0), light, COMPOSITE, TONEMAP, ENCODING);
}
