// How a fused pass ends a bloom: with the finished picture; with MIXED, with the cotangents of the picture
// before exposure and curves, from those of the finished one, the image at ENDED_BINDING.  The including shader has composite.glsl and, for linear texels, pixels.glsl.
#ifdef MIXED
#include "lib/adjoint_composite.glsl"
#ifdef LINEAR_TEXELS
READ_IMAGE(ENDED_BINDING, cotangents);
vec4 cotangent_at(ivec2 pixel)
{
    ivec4 shape = read_shapes[ENDED_BINDING - 1];
    return load_floats(cotangents, shape, clamp(pixel.x, 0, shape.x - 1), pixel.y);
}
#else
layout(set = 0, binding = ENDED_BINDING) uniform sampler2D cotangents;
vec4 cotangent_at(ivec2 pixel)
{
    return texelFetch(cotangents, pixel, 0);
}
#endif
#endif

vec4 ended(vec4 scene, vec4 bloom, ivec2 pixel)
{
#ifdef MIXED
    return back_composite(scene, bloom, 1.0, cotangent_at(pixel), BY_MIXED);
#else
    return finish(scene, bloom, 1.0, pixel);
#endif
}

#ifdef LINEAR_TEXELS
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
