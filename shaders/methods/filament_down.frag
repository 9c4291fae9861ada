#version 450
#extension GL_GOOGLE_include_directive : require
// Filament's downsampling of a level with even sides: 3 x 3 bilinear taps that approximate a
// Gaussian (google/filament, bloomDownsample9.mat @ 523a261b1052).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"
#include "lib/filament.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

vec4 shade()
{
    Place place = PLACE_IN(source);
    vec4 sum = vec4(0.0);
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x)
            sum += FILAMENT_SHARES[x + 1] * FILAMENT_SHARES[y + 1]
                 * sample_at(source, place, FILAMENT_OFFSET * vec2(x, y), SAMPLING);
    return stored(sum);
}
