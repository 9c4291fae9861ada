// The finished picture as Godot blends it: the exposure comes before the composite, soft light after
// the tone map (godotengine/godot, tonemap.glsl @ 001c8c9c24dc).
#include "lib/sampling.glsl"

UNIFORM_BLOCK(GODOT_FINAL_BLOCK);
#include "lib/composite.glsl"

layout(set = 0, binding = 1) uniform sampler2D scene;
layout(set = 0, binding = 2) uniform sampler2D bloom;
layout(set = 0, binding = 3) uniform sampler2D mask;

#define TARGET_BINDING 4
#include "lib/fullscreen.glsl"
#include "lib/godot_blend.glsl"

vec4 shade()
{
    vec4 pixel = texelFetch(scene, PIXEL, 0);
    vec3 exposed = finite_or_zero(pixel.rgb) * exp2(params.exposure);
    vec4 light = texelFetch(bloom, PIXEL, 0);
    float share = MASKED != 0 ? texelFetch(mask, PIXEL, 0).r : 1.0;
    return encoded(pixel, light, blend(exposed, light.rgb, share), PIXEL);
}
