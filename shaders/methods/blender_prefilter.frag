#version 450
#extension GL_GOOGLE_include_directive : require
// The highlights of Blender's Glare node: the part of a colour's brightest channel above the
// threshold, with smooth transitions at both ends (formulas of the compositor of Blender 4.5).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"
#include "lib/highlights.glsl"

// The mean of RADIUS x RADIUS texels. Blender counts rows from the bottom, and repeats the last ones.
vec4 mean_of_texels()
{
    ivec2 first = RADIUS * ivec2(PIXEL.x, params.target_height - 1 - PIXEL.y);
    int last = textureSize(source, 0).y - 1;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < RADIUS; ++y)
        for (int x = 0; x < RADIUS; ++x)
            sum += fetch_clamped(source, ivec2(first.x + x, last - first.y - y));
    return sum / float(RADIUS * RADIUS);
}

vec4 shade()
{
    vec4 value = RADIUS > 1 ? mean_of_texels()
                            : sample_at(source, PLACE_IN(source), vec2(0.0), SAMPLING);
    return stored(mask_value() * highlights(value));
}
