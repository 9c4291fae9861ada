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
#include "lib/mean_of_texels.glsl"

vec4 shade()
{
    vec4 value = RADIUS > 1 ? mean_of_texels(source, PIXEL, params.target_height, RADIUS)
                            : sample_at(source, PLACE_IN(source), vec2(0.0), SAMPLING);
    return stored(mask_value() * highlights(value));
}
