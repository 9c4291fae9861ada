// Texels of an image with 0 outside of it.
vec4 fetch_inside(sampler2D source, ivec2 texel)
{
    bool inside = all(greaterThanEqual(texel, ivec2(0)))
               && all(lessThan(texel, textureSize(source, 0)));
    return inside ? texelFetch(source, texel, 0) : vec4(0.0);
}

// A texel and its neighbours to the right, below, and below right.
vec4[4] fetch_four_inside(sampler2D source, ivec2 texel)
{
    return vec4[4](fetch_inside(source, texel), fetch_inside(source, texel + ivec2(1, 0)),
                   fetch_inside(source, texel + ivec2(0, 1)),
                   fetch_inside(source, texel + ivec2(1, 1)));
}
