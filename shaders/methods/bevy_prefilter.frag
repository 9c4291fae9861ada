#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// Bevy's first downsampling: 13 taps.
#include "lib/block.glsl"
#include "lib/finite.glsl"

// Where the pass reads the image itself, as the threshold pass does.
#define TEXEL(value) (FROM_IMAGE != 0 ? finite_or_zero(value) : (value))
#include "lib/sampling.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"
#include "lib/prefilters.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"

#include "lib/thirteen_taps.glsl"

vec4 shade()
{
    Taps taps = thirteen_taps(PLACE_IN(source), vec2(params.step_x, params.step_y));
    return stored(mask_value() * bevy_prefiltered(taps));
}
