// The cotangents of what a pass writes, for a shader that includes fullscreen.glsl or values.glsl after SLOT_COTANGENTS.

// A bloom without alpha has none of it.
vec4 cotangent_of_target()
{
    vec4 cotangent = texelFetch(cotangents, PIXEL, 0);
    return ALPHA == ALPHA_BLUR ? cotangent : vec4(cotangent.rgb, 0.0);
}
