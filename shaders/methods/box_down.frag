#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// Downsamples a level with four diagonal taps at a distance of one texel: a box of 4 x 4 texels.
// The firefly filter weights the taps by brightness and renormalizes (Karis 2013; keijiro/KinoBloom
// @ 0a04c43fa47d, Bloom.cginc).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"
#include "lib/groups.glsl"

vec4 shade()
{
    const vec2 corners[4] = vec2[](vec2(-1, -1), vec2(1, -1), vec2(-1, 1), vec2(1, 1));
    Place place = PLACE_IN(source);
    vec4 taps[4];
    for (int corner = 0; corner < 4; ++corner)
        taps[corner] = sample_at(source, place, corners[corner], SAMPLING);
    return stored(box_of(taps));
}
