// The elements of the lines that a Fourier transform starts from: the glow, and what lies beyond its
// edges. Include this after the functions `load_source(ivec2)`, `texel_at` and `weight_at`.

#include "lib/bright.glsl"

vec4 load_lit(int along, int across)
{
    vec4 texel = load_source(texel_at(along, across));
    if (STAGE == STAGE_FIRST)
        texel = glow_of(texel);
    return WEIGHTED != 0 && INVERSE == 0 ? weight_at(along, across) * texel : texel;
}

// What the transform has at a place of the padded line. Where that lies before the source's first texel
// it is from `turn` on.
vec4 load_padded(int along, int across)
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
    place = inside ? texel_place : clamp(place, 0, params.extent - 1);
    vec4 texel = load_lit(place, across);
    return inside || BOUNDARY != BOUNDARY_ZERO ? texel : vec4(0.0);
}

vec4 load(int along, int across)
{
    return PADDED != 0 ? load_padded(along, across) : load_lit(along, across);
}
