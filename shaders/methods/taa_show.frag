// The light of what temporal anti-aliasing has kept of a frame. The frame's alpha stays, and what is not finite.
#include "lib/taa.glsl"

vec4 shade()
{
    vec4 frame = texelFetch(source, PIXEL, 0);
    vec3 light = texelFetch(before, PIXEL, 0).rgb;
    if (ENGINE == TAA_BEVY)
        light *= 1.0 / max(1.0 - largest(light), exp2(-24.0));
    return vec4(mix(frame.rgb, light, is_finite(frame.rgb)), frame.a);
}
