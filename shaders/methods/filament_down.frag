#version 450
#extension GL_GOOGLE_include_directive : require
// Filament's downsampling of a level with even sides: 3 x 3 bilinear taps that approximate a
// Gaussian (google/filament, bloomDownsample9.mat @ 523a261b1052).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

const float OFFSET = 1.761629;
const float OUTER = 7.46602 / 32.0;

vec4 shade()
{
    const float shares[3] = float[](OUTER, 1.0 - 2.0 * OUTER, OUTER);
    Place place = PLACE_IN(source);
    vec4 sum = vec4(0.0);
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x)
            sum += shares[x + 1] * shares[y + 1]
                 * sample_at(source, place, OFFSET * vec2(x, y), SAMPLING);
    return stored(sum);
}
