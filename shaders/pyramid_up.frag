#version 450
#extension GL_GOOGLE_include_directive : require
// A level of the pyramid on the way up: its own share and, through the 3 x 3 tent (1 2 1)^2 / 16,
// that of the smaller level.
#include "block.glsl"
#include "sampling.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "storage.glsl"

layout(constant_id = 0) const int SAMPLING = SAMPLING_FILTER;
layout(constant_id = 1) const int ADD_OWN = 1;

layout(set = 0, binding = 1) uniform sampler2D smaller;
layout(set = 0, binding = 2) uniform sampler2D own;

layout(location = 0) out vec4 colour;

vec3 tent(Place place)
{
    vec3 sum = vec3(0.0);
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
            vec2 offset = params.radius * vec2(x, y);
            float weight = (2.0 - abs(float(x))) * (2.0 - abs(float(y))) / 16.0;
            sum += weight * sample_at(smaller, place, offset, SAMPLING).rgb;
        }
    return sum;
}

void main()
{
    Place place = place_in(smaller, ivec2(gl_FragCoord.xy),
                           ivec2(params.target_width, params.target_height));
    vec3 sum = params.coarse * tent(place);
    if (ADD_OWN != 0)
        sum += params.own * texelFetch(own, ivec2(gl_FragCoord.xy), 0).rgb;
    colour = vec4(storable(sum), 1.0);
}
