// Four weights of a field at each pixel: linear between the places of a grid. `places` has, for each column in
// its first row and for each row in its second one, the place before it and the share of the next one; its third
// channel is for adjoint_weights.frag.

UNIFORM_BLOCK(FIELD_WEIGHTS_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, grids);
SAMPLED_IMAGE(SLOT_PLACES, places);

#include "lib/fullscreen.glsl"

vec4 weights_at(int column, int row)
{
    ivec2 size = ivec2(params.columns, params.rows);
    ivec2 grid = ivec2(params.grid % params.grids, params.grid / params.grids);
    return texelFetch(grids, clamp(ivec2(column, row), ivec2(0), size - 1) + grid * size, 0);
}

vec4 shade()
{
    vec2 x = texelFetch(places, ivec2(PIXEL.x, 0), 0).rg, y = texelFetch(places, ivec2(PIXEL.y, 1), 0).rg;
    int column = int(x.r), row = int(y.r);
    vec4 above = mix(weights_at(column, row), weights_at(column + 1, row), x.g);
    vec4 below = mix(weights_at(column, row + 1), weights_at(column + 1, row + 1), x.g);
    return mix(above, below, y.g);
}
