// Lights the G-buffer with the forward system's Phong model, and adds the emission.
#include "scene/phong.glsl"

SAMPLED_IMAGE(SLOT_ALBEDO, albedo);
SAMPLED_IMAGE(SLOT_NORMAL, normal);
SAMPLED_IMAGE(SLOT_POSITION, position);
SAMPLED_IMAGE(SLOT_BRIGHTNESS, brightness);

#include "lib/fullscreen.glsl"

vec4 shade()
{
    ivec2 pixel = PIXEL;
    vec3 base = texelFetch(albedo, pixel, 0).rgb;
    vec3 n = texelFetch(normal, pixel, 0).xyz;
    vec3 lit = base;
    if (any(notEqual(n, vec3(0.0))))
        lit = phong(base, normalize(n), texelFetch(position, pixel, 0).xyz);
    return vec4(storable(lit + texelFetch(brightness, pixel, 0).rgb), 1.0);
}
