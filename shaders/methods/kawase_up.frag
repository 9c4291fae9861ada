#version 450
#extension GL_GOOGLE_include_directive : require
// Upsampling of dual Kawase: four axial taps at a distance of one texel of the smaller level times
// the offset, and four diagonal taps at half that distance with twice the weight (source:
// kawase_down.frag).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(KAWASE_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D smaller;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

vec4 shade()
{
    Place place = PLACE_IN(smaller);
    vec2 axial = vec2(params.offset, 0.0);
    vec2 diagonal = vec2(0.5, -0.5) * params.offset;
    vec4 sum = sample_at(smaller, place, axial.xy, SAMPLING);
    sum += sample_at(smaller, place, -axial.xy, SAMPLING);
    sum += sample_at(smaller, place, axial.yx, SAMPLING);
    sum += sample_at(smaller, place, -axial.yx, SAMPLING);
    vec4 diagonals = sample_at(smaller, place, diagonal.xx, SAMPLING);
    diagonals += sample_at(smaller, place, diagonal.xy, SAMPLING);
    diagonals += sample_at(smaller, place, diagonal.yx, SAMPLING);
    diagonals += sample_at(smaller, place, diagonal.yy, SAMPLING);
    return stored((sum + 2.0 * diagonals) / 12.0);
}
