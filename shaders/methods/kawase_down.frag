#version 450
#extension GL_GOOGLE_include_directive : require
// Downsampling of dual Kawase: four times the centre, and four diagonal taps at a distance of half
// a source texel times the offset (Bjorge, "Bandwidth-Efficient Rendering", SIGGRAPH 2015).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(KAWASE_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

vec4 shade()
{
    Place place = PLACE_IN(source);
    vec2 diagonal = vec2(0.5, -0.5) * params.offset;
    vec4 sum = 4.0 * sample_at(source, place, vec2(0.0), SAMPLING);
    sum += sample_at(source, place, diagonal.xx, SAMPLING);
    sum += sample_at(source, place, diagonal.xy, SAMPLING);
    sum += sample_at(source, place, diagonal.yx, SAMPLING);
    sum += sample_at(source, place, diagonal.yy, SAMPLING);
    return stored(sum / 8.0);
}
