// The cotangents of the light at the end of Blender's glare (blender_end.frag), at the pixels of the
// bloom.
#include "lib/block.glsl"
#include "lib/finite.glsl"
#include "lib/sampling.glsl"
#include "lib/threshold_slope.glsl"

UNIFORM_BLOCK(BLENDER_END_BLOCK);

layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 2) uniform sampler2D cotangents;

#define TARGET_BINDING 5
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"

// A colour whose channels are equal, or 0, that are so but for rounding.
vec3 settled(vec3 value)
{
    value = mix(value, vec3(0.0), lessThanEqual(abs(value), vec3(params.rounding)));
    for (int i = 0; i < 2; ++i) {
        float extreme = i == 0 ? max(value.r, max(value.g, value.b))
                               : min(value.r, min(value.g, value.b));
        float least = params.rounding * (1.0 + 10.0 * abs(extreme));
        value = mix(value, vec3(extreme), lessThanEqual(abs(value - extreme), vec3(least)));
    }
    return value;
}

// Through most - scale (most - value) with the scale min(saturation, most / spread). Around a grey the
// scale is the saturation, around black at most 1/2 (reference/blender.py).
vec3 back_saturated(vec3 value, vec3 cotangent)
{
    float most = max(value.r, max(value.g, value.b)), least = min(value.r, min(value.g, value.b));
    float spread = most - least, sum = dot(cotangent, vec3(1.0));
    vec3 at_most = shares_of_brightest(value), at_least = shares_of_brightest(-value);
    if (most < 0.0)
        return at_most * sum;
    float scale = most > 0.0 ? params.saturation : min(params.saturation, 0.5);
    if (scale * spread < most || spread == 0.0)
        return scale * cotangent + at_most * ((1.0 - scale) * sum);
    // Where both scales are equal, or the largest channel is 0, half of the derivative of one.
    float share = (scale * spread == most ? 0.5 : 1.0) * (most == 0.0 ? 0.5 : 1.0);
    scale = most / spread;
    float by_scale = share * (dot(cotangent, value) - most * sum) / (spread * spread);
    return scale * cotangent + at_most * ((1.0 - scale) * sum)
         + (at_least * most - at_most * least) * by_scale;
}

vec4 shade()
{
    Place place = PLACE_IN(source);
    vec4 value = fetch_bilinear(source, place.texel, place.part);
    vec4 cotangent = params.factors[0] * texelFetch(cotangents, PIXEL, 0);
    return gathered(vec4(back_saturated(settled(value.rgb), cotangent.rgb), ALPHA == ALPHA_BLUR ? cotangent.a : 0.0));
}
