// The cotangents of what Blender's sun beams add up for a pixel: those of the mean, over the sum of the weights. A pixel
// without weights shows itself.

UNIFORM_BLOCK(SUN_BEAMS_BLOCK);
#include "lib/beam.glsl"

layout(set = 0, binding = 1) uniform sampler2D cotangents;

#include "lib/fullscreen.glsl"

vec4 shade()
{
    Beam beam = beam_of(PIXEL, textureSize(cotangents, 0));
    float weights = 0.0;
    for (int i = 0; i <= beam.last; ++i) {
        float at = steps_to(beam, i);
        if (!is_place(beam.share + at * beam.towards))
            break;
        weights += weight_at(beam, at);
    }
    return texelFetch(cotangents, PIXEL, 0) / (weights > 0.0 ? weights : 1.0);
}
