// How a fused pass ends a bloom: with the finished picture; with MIXED, with the cotangents of the picture before
// exposure and curves, from those of the finished one; with TRANSPOSED, with the derivatives by the image, from the
// cotangents of a composite without a curve, which is a factor, and their transposed blur, or, unless ADDS_IMAGE, with
// those by the glow, which are the blur's. The image of SLOT_ENDED is then these cotangents or the image. The including
// shader has composite.glsl and, for linear texels, pixels.glsl.
#ifndef TRANSPOSED
#define TRANSPOSED 0
#endif

#if defined(MIXED) || TRANSPOSED
#ifdef LINEAR_TEXELS
READ_IMAGE(SLOT_ENDED, other);
vec4 other_at(ivec2 pixel)
{
    ivec4 shape = read_shapes[SLOT_ENDED];
    return load_floats(other, shape, clamp(pixel.x, 0, shape.x - 1), pixel.y);
}
#else
SAMPLED_IMAGE(SLOT_ENDED, other);
vec4 other_at(ivec2 pixel)
{
    return texelFetch(other, pixel, 0);
}
#endif
#endif

#ifdef MIXED
#include "lib/adjoint_composite.glsl"

vec4 ended(vec4 scene, vec4 bloom, ivec2 pixel)
{
    return back_composite(scene, bloom, 1.0, other_at(pixel), BY_MIXED);
}
#elif TRANSPOSED
// Copies of parameters and of factors (see pixels.glsl).
float exposed = exp2(params.exposure), gain = exposed * (LIT != 0 ? 1.0 : params.intensity);
float share = exposed * (COMPOSITE == COMPOSITE_MIX ? 1.0 - params.intensity : 1.0);
float threshold = params.threshold, knee = params.knee;

vec4 ended(vec4 own, vec4 blurred, ivec2 pixel)
{
    vec4 scene = other_at(pixel), found = vec4(gain * blurred.rgb, 0.0);
    if (ADDS_IMAGE == 0)
        return found;
    found = back_through_threshold(finite_or_zero(scene), found, THRESHOLD_MODE, threshold, knee);
    return where_finite(found + vec4(vec3(share), 1.0) * own, scene);
}
#else
vec4 ended(vec4 scene, vec4 bloom, ivec2 pixel)
{
    return finish(scene, bloom, 1.0, pixel);
}
#endif

#ifdef LINEAR_TEXELS
uvec4 ended(uvec4 own, vec4 bloom, ivec2 pixel)
{
    vec4 value = ended(value_of(own), bloom, pixel);
#if defined(MIXED) || TRANSPOSED
    return raw_of(value);
#else
    return finished(own, value);
#endif
}
#endif
