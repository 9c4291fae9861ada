// Combines scene and bloom, then applies exposure, tone map, encoding and dither. The including
// shader needs storage.glsl, and the parameters intensity, exposure and noise_seed.

#include "lib/dither.glsl"
#include "lib/finite.glsl"
#include "lib/tonemap.glsl"

vec3 composite(vec3 s, vec3 b)
{
    if (COMPOSITE == COMPOSITE_MIX)
        return s + (b - s) * params.intensity;
    if (COMPOSITE == COMPOSITE_SCREEN) {
        // 1 - (1 - s)(1 - b), expanded: differences from 1 lose the precision of dark values.
        s = clamp(s, 0.0, 1.0);
        return s + (1.0 - s) * clamp(params.intensity * b, 0.0, 1.0);
    }
    if (COMPOSITE == COMPOSITE_ADD)
        return s + params.intensity * b;
    return s;
}

// NaN and infinity of the scene stay in their own pixels and channels: some curves would change
// them, and curves that mix channels would spread them.
vec4 encoded(vec4 scene, vec3 toned, ivec2 pixel)
{
    vec3 result = apply_encoding(toned, ENCODING);
    if (DITHER != 0)
        result = dithered(result, pixel, params.noise_seed);
    return vec4(mix(scene.rgb, storable(result), is_finite(scene.rgb)), scene.a);
}

vec4 finish(vec4 scene, vec3 bloom, ivec2 pixel)
{
    vec3 result = composite(finite_or_zero(scene.rgb), bloom);
    return encoded(scene, apply_tonemap(result * exp2(params.exposure), TONEMAP), pixel);
}
