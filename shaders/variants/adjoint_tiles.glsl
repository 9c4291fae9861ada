// The images of the transpose of a filter in tiles, as of adjoint_filter.frag. Before it is included,
// FINITE's functions (lib/finite.glsl) and `params`.
#include "lib/where_finite.glsl"

layout(set = 0, binding = 1) uniform sampler2D cotangents;
layout(set = 0, binding = 3) uniform sampler2D scene;
layout(set = 0, binding = 4) uniform sampler2D added;
layout(set = 0, binding = 5) uniform sampler2D differentiated;
layout(set = 0, binding = 6) uniform writeonly image2D target;

// 0 outside of the image, where no pixel reads a texel.
vec4 cotangent_at(ivec2 place)
{
    ivec2 within = clamp(place, ivec2(0), textureSize(cotangents, 0) - 1);
    vec4 value = texelFetch(cotangents, within, 0);
    if (BY == BY_BLOOM)
        value = vec4(where_finite(value, texelFetch(scene, within, 0)).rgb, 0.0);
    return place == within ? value : vec4(0.0);
}

// What other readers have accumulated to a pixel, which may be outside.
vec4 added_at(ivec2 pixel)
{
    ivec2 within = min(pixel, imageSize(target) - 1);
    return ADD_OWN != 0 ? vec4(vec3(params.share), 1.0) * texelFetch(added, within, 0) : vec4(0.0);
}

void store_sum(ivec2 pixel, vec4 sum)
{
    if (any(greaterThanEqual(pixel, imageSize(target))))
        return;
    if (FROM_IMAGE != 0)
        sum = where_finite(sum, texelFetch(differentiated, pixel, 0));
    imageStore(target, pixel, sum);
}
