// The elements of the lines that a Fourier transform starts from: the glow, and what lies beyond its
// edges.

#include "lib/bright.glsl"

#define LOADED_IMAGE(slot, name, format) \
    layout(set = 0, binding = BINDING_OF(slot), format) uniform readonly image2D name

LOADED_IMAGE(SLOT_SOURCE, source, SOURCE_FORMAT);
LOADED_IMAGE(SLOT_WEIGHTS, weights, rgba32f);

const bool IS_ROW = DIRECTION == DIRECTION_HORIZONTAL;

ivec2 texel_at(int along, int across)
{
    return IS_ROW ? ivec2(along, across) : ivec2(across, along);
}

// The weight of a field's kernel at a pixel.
float weight_at(int along, int across)
{
    ivec2 place = IS_ROW ? ivec2(along, across) : ivec2(0, along);
    vec4 four = imageLoad(weights, clamp(place, ivec2(0), imageSize(weights) - 1));
    return inner_product(four, vec4(equal(ivec4(0, 1, 2, 3), ivec4(params.weight))));
}

// Where a place of the padded line has its texel, and whether it has one: positions before the source's
// first texel are from `turn` on.
int padded_place(int along, out bool has_texel)
{
    int texel_place = along - params.first;
    bool inside = texel_place >= 0 && texel_place < params.extent, behind = along < params.turn;
    int place;
    if (BOUNDARY == BOUNDARY_WRAP)
        place = behind ? along - params.extent : along - params.padded + params.extent;
    else if (BOUNDARY == BOUNDARY_MIRROR)
        place = behind ? 2 * params.extent - 1 - along : params.padded - 1 - along;
    else
        place = behind ? params.extent - 1 : 0;
    has_texel = inside || BOUNDARY != BOUNDARY_ZERO;
    return inside ? texel_place : clamp(place, 0, params.extent - 1);
}

vec4 load(int along, int across)
{
    bool has_texel = true;
    int place = PADDED != 0 ? padded_place(along, has_texel) : along;
    vec4 texel = imageLoad(source, texel_at(place, across));
    if (STAGE == STAGE_FIRST)
        texel = glow_of(texel);
    if (WEIGHTED != 0 && INVERSE == 0)
        texel *= weight_at(place, across);
    return has_texel ? texel : vec4(0.0);
}
