#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// Downsamples a level with 13 taps, or with the four inner ones, in groups that are weighted by brightness
// (GROUPS: lib/groups.glsl).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"

#include "lib/groups.glsl"
#include "lib/thirteen_taps.glsl"

vec4 shade()
{
    vec2 tap_step = vec2(params.step_x, params.step_y);
    return stored(mask_value() * combined(thirteen_taps(PLACE_IN(source), tap_step)));
}
