// Samples at positions in texels (the first texel's centre is 0.5), clamped to the edge. A shader
// that includes this may define TEXEL to change what is read of a texel.

#ifndef TEXEL
#define TEXEL(value) (value)
#endif

vec4 fetch_clamped(sampler2D image, ivec2 texel)
{
    return TEXEL(texelFetch(image, clamp(texel, ivec2(0), textureSize(image, 0) - 1), 0));
}

// Bilinear in full float precision: hardware filters have 8 bits of position, or fewer.
vec4 fetch_bilinear(sampler2D image, vec2 position)
{
    vec2 base = floor(position - 0.5);
    vec2 part = position - 0.5 - base;
    ivec2 texel = ivec2(base);
    vec4 top = mix(fetch_clamped(image, texel), fetch_clamped(image, texel + ivec2(1, 0)), part.x);
    vec4 bottom = mix(fetch_clamped(image, texel + ivec2(0, 1)),
                      fetch_clamped(image, texel + ivec2(1, 1)), part.x);
    return mix(top, bottom, part.y);
}

vec4 sample_at(sampler2D image, vec2 position, int sampling)
{
    if (sampling == SAMPLING_WHOLE)
        return fetch_clamped(image, ivec2(floor(position)));
    if (sampling == SAMPLING_FETCH)
        return fetch_bilinear(image, position);
    return texture(image, position / vec2(textureSize(image, 0)));
}
