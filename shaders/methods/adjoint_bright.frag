// The cotangents of what is convolved, from those of what its filter of bright colours makes of it. FROM_IMAGE: it is
// the image itself, as the threshold pass reads it.

UNIFORM_BLOCK(FFT_BLOCK);
#include "lib/bright.glsl"

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"

vec4 shade()
{
    vec4 cotangent = texelFetch(cotangents, PIXEL, 0);
    vec4 texel = texelFetch(source, PIXEL, 0);
    cotangent.rgb = back_prefiltered((FROM_IMAGE != 0 ? finite_or_zero(texel) : texel).rgb, cotangent.rgb);
    return gathered(cotangent);
}
