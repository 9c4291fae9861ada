// The source of a stage of glare: what is above the stage's threshold, and nothing outside of the
// image. The including shader's block has a threshold.
#include "lib/above.glsl"

vec4 fetch_inside(sampler2D source, ivec2 texel)
{
    bool inside = all(greaterThanEqual(texel, ivec2(0)))
               && all(lessThan(texel, textureSize(source, 0)));
    return inside ? texelFetch(source, texel, 0) : vec4(0.0);
}
