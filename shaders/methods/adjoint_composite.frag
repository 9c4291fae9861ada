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

Pixel pixel_at(ivec2 at)
{
    return pixel_of(texelFetch(scene, at, 0),
                    COMPOSITE == COMPOSITE_OFF ? vec4(0.0) : texelFetch(bloom, at, 0),
                    MASKED != 0 ? texelFetch(mask, at, 0).r : 1.0, texelFetch(cotangents, at, 0));
}

vec4 by_values(ivec2 at)
{
    Pixel p = pixel_at(at);
    vec3 unit = COMPOSITE == COMPOSITE_MIX ? p.bloom.rgb - p.share * p.scene.rgb : p.bloom.rgb;
    float by_intensity = COMPOSITE == COMPOSITE_OFF
                           ? 0.0
                           : dot(by_light(p), unit) + dot(by_alpha_light(p), p.bloom);
    return vec4(by_intensity, p.by_curves, 0.0);
}

SUM_OF_BLOCK(by_values)

vec4 shade()
{
    if (BY >= BY_VALUES)
        return sum_of_block(textureSize(scene, 0));
    Pixel p = pixel_at(PIXEL);
    if (BY == BY_MASK)
        return gathered(vec4(-params.intensity * dot(p.by_mixed, p.scene.rgb), 0.0, 0.0, 0.0));
    return gathered(BY == BY_BLOOM ? by_bloom(p) : by_scene(p));
}
