#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The first downsample of Blender's bloom: 13 taps in five groups of four. Within a group, brighter
// taps weigh less, against fireflies (formulas of the compositor of Blender 4.5).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

#include "lib/groups.glsl"
#include "lib/thirteen_taps.glsl"

vec4 shade()
{
    return stored(blender_groups(thirteen_taps(PLACE_IN(source), vec2(1.0))));
}
