// The end of Blender's glare, enlarged, for shaders with BLENDER_END_BLOCK and `source`. Include sampling.glsl and
// fullscreen.glsl before this file.

vec4 enlarged()
{
    Place place = PLACE_IN(source);
    if (params.reads_next != 0)
        place.texel = next_texel(source, place.texel, params.next[0]);
    return fetch_bilinear(source, place.texel, place.part);
}

#include "lib/saturated.glsl"
