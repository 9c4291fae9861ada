// Scene and bloom, exposure, tone map, encoding, dither. A shader that includes this has intensity,
// exposure and noise_seed among its parameters, and storage.glsl.

#include "lib/dither.glsl"
#include "lib/finite.glsl"
#include "lib/tonemap.glsl"

vec3 composite(vec3 s, vec3 b)
{
    if (COMPOSITE == COMPOSITE_MIX)
        return s + (b - s) * params.intensity;
    if (COMPOSITE == COMPOSITE_SCREEN) {
        // 1 - (1 - s)(1 - b) without the differences of ones, in which dark values are lost.
        s = clamp(s, 0.0, 1.0);
        return s + (1.0 - s) * clamp(params.intensity * b, 0.0, 1.0);
    }
    if (COMPOSITE == COMPOSITE_ADD)
        return s + params.intensity * b;
    return s;
}

// NaN and infinity of the scene stay at their own pixels, whatever the curve makes of them, and
// curves that mix the channels must not spread one channel's NaN to the others.
vec4 finish(vec4 scene, vec3 bloom, ivec2 pixel)
{
    vec3 result = composite(finite_or_zero(scene.rgb), bloom);
    result = apply_encoding(apply_tonemap(result * exp2(params.exposure), TONEMAP), ENCODING);
    if (DITHER != 0)
        result = dithered(result, pixel, params.noise_seed);
    return vec4(mix(scene.rgb, storable(result), is_finite(scene.rgb)), scene.a);
}
