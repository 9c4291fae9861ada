// How a fused pass ends a bloom: with the finished picture; with MIXED, with the cotangents of the picture
// before exposure and curves, of which COTANGENT(pixel) are those of the finished one. The including shader
// has composite.glsl.
#ifdef MIXED
#include "lib/where_finite.glsl"
#include "lib/adjoint_composite.glsl"
#endif

vec4 ended(vec4 scene, vec4 bloom, ivec2 pixel)
{
#ifdef MIXED
    return back_composite(scene, bloom, 1.0, COTANGENT(pixel), BY_MIXED);
#else
    return finish(scene, bloom, pixel);
#endif
}

#ifdef WORDS
uvec4 ended(uvec4 own, vec4 bloom, ivec2 pixel)
{
    vec4 value = ended(value_of(own), bloom, pixel);
#ifdef MIXED
    return raw_of(value);
#else
    return finished(own, value);
#endif
}
#endif
