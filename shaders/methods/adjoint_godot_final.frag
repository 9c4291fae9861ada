// The cotangents of Godot's composite (godot_final.frag): of the scene, of the bloom or of the mask.
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(GODOT_FINAL_BLOCK);
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
#include "lib/godot_blend.glsl"

// By the exposed scene and by the light.
struct Parts {
    mat2x3 scene, light;
};

Parts back_soft_light(vec3 s, vec3 light, mat2x3 cotangents)
{
    vec3 toned = apply_tonemap(s, TONEMAP), toned_light = apply_tonemap(light, TONEMAP);
    vec3 low = max(toned, -1e6), dark = (48.0 * low - 24.0) * low + 4.0;
    vec3 slope = mix(0.5 / sqrt(max(toned, 0.25)), dark, lessThanEqual(toned, vec3(0.25)));
    mat2x3 lit = matrixCompMult(cotangents, below(toned, 1.0));
    mat2x3 by_toned = cotangents + times(lit, clamp(toned_light, 0.0, 1.0) * (slope - 1.0));
    mat2x3 by_light =
        matrixCompMult(times(lit, soft_full(toned) - toned), inside(toned_light, 0.0, 1.0));
    return Parts(back_through_tonemap(s, by_toned, TONEMAP),
                 back_through_tonemap(light, by_light, TONEMAP));
}

Parts back_blend(vec3 s, vec3 bloom_light, float share, mat2x3 cotangents)
{
    vec3 light = light_of(bloom_light);
    if (COMPOSITE == COMPOSITE_SOFT_LIGHT)
        return back_soft_light(s, light, cotangents);
    mat2x3 by_sum = back_through_tonemap(blended_sum(s, bloom_light, share), cotangents, TONEMAP);
    if (COMPOSITE == COMPOSITE_MIX)
        return Parts((1.0 - params.intensity * share) * by_sum, by_sum);
    if (COMPOSITE == COMPOSITE_REPLACE)
        return Parts(mat2x3(0.0), by_sum);
    if (COMPOSITE == COMPOSITE_SCREEN) {
        vec3 part = light / params.white;
        return Parts(times(by_sum, 1.0 - clamp(part, 0.0, 1.0)),
                     matrixCompMult(times(by_sum, (params.white - s) / params.white),
                                    inside(part, 0.0, 1.0)));
    }
    return Parts(by_sum, by_sum);
}

mat2x4 back_on_sides(vec4 pixel)
{
    Pixel p;
    p.scene = finite_or_zero(pixel);
    p.bloom = texelFetch(bloom, PIXEL, 0);
    p.share = MASKED != 0 ? texelFetch(mask, PIXEL, 0).r : 1.0;
    vec4 cotangent = where_finite(texelFetch(cotangents, PIXEL, 0), pixel);
    p.by_alpha = cotangent.a * first_row(stored(vec3(mixed_alpha(p.scene, p.bloom))));
    vec3 s = p.scene.rgb * exp2(params.exposure);
    mat2x3 by_toned = back_through_encoding(blend(s, p.bloom.rgb, p.share), cotangent.rgb);
    Parts parts = back_blend(s, p.bloom.rgb, p.share, by_toned);
    if (BY == BY_MASK)
        return outerProduct(vec4(1.0, 0.0, 0.0, 0.0), -params.intensity * dots(parts.light, s));
    if (BY == BY_SCENE)
        return with_alpha(parts.scene * exp2(params.exposure), p.by_alpha * alpha_slope(p));
    float gain = BLOOM == BLOOM_LIT ? 1.0 : params.intensity;
    return gain * (with_alpha(parts.light, vec2(0.0)) + by_alpha_light(p));
}

vec4 shade()
{
    return gathered(mean_of_sides(back_on_sides(texelFetch(scene, PIXEL, 0))));
}
