#version 450
#extension GL_GOOGLE_include_directive : require
// The cotangents of the composite: of the scene, of the bloom, of the mask, or of intensity, exposure
// and reference white, whose sums are their derivatives.
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(COMPOSITE_BLOCK);
#include "lib/storage.glsl"
#include "lib/composite.glsl"

layout(set = 0, binding = 1) uniform sampler2D scene;
layout(set = 0, binding = 2) uniform sampler2D bloom;
layout(set = 0, binding = 3) uniform sampler2D mask;
layout(set = 0, binding = 4) uniform sampler2D cotangents;

#define TARGET_BINDING 7
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"
#include "lib/adjoint_composite.glsl"
#include "lib/sums.glsl"

vec4 back(ivec2 at)
{
    return back_composite(
        texelFetch(scene, at, 0), COMPOSITE == COMPOSITE_OFF ? vec4(0.0) : texelFetch(bloom, at, 0),
        MASKED != 0 ? texelFetch(mask, at, 0).r : 1.0, texelFetch(cotangents, at, 0), BY);
}

SUM_OF_BLOCK(back)

vec4 shade()
{
    return BY == BY_VALUES || BY == BY_SQUARES ? sum_of_block(textureSize(scene, 0)) : gathered(back(PIXEL));
}
