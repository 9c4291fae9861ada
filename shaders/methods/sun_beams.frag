#version 450
#extension GL_GOOGLE_include_directive : require
// Blender's sun beams: the weighted mean of the pixels between each pixel and the sun (formulas of the
// compositor of Blender 5.0).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(SUN_BEAMS_BLOCK);
#include "lib/storage.glsl"
#include "lib/beam.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

vec4 fetch_inside(ivec2 texel)
{
    bool inside = all(greaterThanEqual(texel, ivec2(0)))
               && all(lessThan(texel, textureSize(source, 0)));
    return inside ? texelFetch(source, texel, 0) : vec4(0.0);
}

// The source at a share of its sides, with 0 outside of it.
vec4 sample_inside(vec2 share)
{
    vec2 place = texels_of(share, textureSize(source, 0)), integer = floor(place);
    ivec2 texel = ivec2(integer);
    vec4 four[4] = vec4[4](fetch_inside(texel), fetch_inside(texel + ivec2(1, 0)),
                           fetch_inside(texel + ivec2(0, 1)), fetch_inside(texel + ivec2(1, 1)));
    return bilinear(four, place - integer);
}

vec4 shade()
{
    Beam beam = beam_of(PIXEL, textureSize(source, 0));
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    for (int i = 0; i <= beam.last; ++i) {
        float at = steps_to(beam, i);
        vec2 place = beam.share + at * beam.towards;
        if (!is_place(place))
            break;
        float weight = weight_at(beam, at);
        weights += weight;
        sum += weight * sample_inside(place);
    }
    return stored(weights > 0.0 ? sum / weights : texelFetch(source, PIXEL, 0));
}
