// Scene and bloom, exposure, tone map, encoding. A shader that includes this has intensity and
// exposure among its parameters, and storage.glsl.
#include "finite.glsl"
#include "tonemap.glsl"

vec3 composite(vec3 s, vec3 b, int mode)
{
    if (mode == COMPOSITE_MIX)
        return s + (b - s) * params.intensity;
    if (mode == COMPOSITE_SCREEN)
        return 1.0 - (1.0 - clamp(s, 0.0, 1.0)) * (1.0 - clamp(params.intensity * b, 0.0, 1.0));
    if (mode == COMPOSITE_ADD)
        return s + params.intensity * b;
    return s;
}

// NaN and infinity of the scene stay at their own pixels, whatever the curve makes of them, and
// curves that mix the channels must not spread one channel's NaN to the others.
vec4 finish(vec4 scene, vec3 bloom, int mode, int tonemap, int encoding)
{
    vec3 result = composite(finite_or_zero(scene.rgb), bloom, mode);
    result = apply_encoding(apply_tonemap(result * exp2(params.exposure), tonemap), encoding);
    return vec4(mix(scene.rgb, storable(result), is_finite(scene.rgb)), scene.a);
}
