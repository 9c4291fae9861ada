// Blender's sun beams: the weighted mean of the pixels between each pixel and the sun (formulas of the
// compositor of Blender 5.0).
#include "lib/sampling.glsl"

UNIFORM_BLOCK(SUN_BEAMS_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, source);

#include "lib/fullscreen.glsl"
#include "lib/fetch_inside.glsl"
#include "lib/beam.glsl"

// The source at a share of its sides, with 0 outside of it.
vec4 sample_inside(vec2 share)
{
    vec2 place = texels_of(share, textureSize(source, 0)), integer = floor(place);
    return bilinear(fetch_four_inside(source, ivec2(integer)), place - integer);
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
