#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// pygfx' first downsample: 13 taps, or the mean of their five groups weighted only by brightness;
// at least 0 (pygfx/pygfx, pygfx/renderers/wgpu/engine/bloom.py @ f5f8f72c).
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
    return stored(mask_value() * pygfx_groups(thirteen_taps(PLACE_IN(source), vec2(1.0))));
}
