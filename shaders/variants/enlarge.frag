// Enlarges a blur that ran at the size of the bloom buffers: samples its lines, which have a border
// of one texel, for every pixel of a target of another size.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(THRESHOLD_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, lines);

#include "lib/fullscreen.glsl"

vec4 shade()
{
    ivec2 size = ivec2(params.target_width, params.target_height);
    return stored(sample_bordered(lines, PIXEL, size, SAMPLING));
}
