// Where Blender's sun beams need no samples (sun_beams.frag): the alpha of a block of texels and of its surroundings, if
// all of these are black and have the same alpha; else -1. Outside of the image all channels are 0.

UNIFORM_BLOCK(SUN_BEAMS_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, source);

#include "lib/fullscreen.glsl"
#include "lib/fetch_inside.glsl"

vec4 shade()
{
    ivec2 first = BEAM_BLOCK * PIXEL - BEAM_RUN, last = BEAM_BLOCK * (PIXEL + 1) + BEAM_RUN;
    vec4 dark = vec4(vec3(0.0), fetch_inside(source, first).a);
    bool is_dark = true;
    for (int y = first.y; is_dark && y <= last.y; ++y)
        for (int x = first.x; is_dark && x <= last.x; ++x)
            is_dark = fetch_inside(source, ivec2(x, y)) == dark;
    return vec4(is_dark ? dark.a : -1.0);
}
