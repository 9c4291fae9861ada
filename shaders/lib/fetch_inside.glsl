// Texels of an image with 0 outside of it.
vec4 fetch_inside(sampler2D source, ivec2 texel)
{
    bool inside = all(greaterThanEqual(texel, ivec2(0)))
               && all(lessThan(texel, textureSize(source, 0)));
    return inside ? texelFetch(source, texel, 0) : vec4(0.0);
}

// Bilinear filter of a texel and its neighbours to the right, below, and below right. What is outside has no weight,
// which costs less than to choose 0 for each channel.
vec4 bilinear_inside(sampler2D source, ivec2 texel, vec2 part)
{
    ivec2 last = textureSize(source, 0) - 1;
    ivec2 low = clamp(texel, ivec2(0), last), high = clamp(texel + 1, ivec2(0), last);
    vec2 first = mix(vec2(0.0), 1.0 - part, equal(low, texel)), second = mix(vec2(0.0), part, equal(high, texel + 1));
    vec4 upper = first.x * texelFetch(source, low, 0) + second.x * texelFetch(source, ivec2(high.x, low.y), 0);
    vec4 lower = first.x * texelFetch(source, ivec2(low.x, high.y), 0) + second.x * texelFetch(source, high, 0);
    return first.y * upper + second.y * lower;
}
