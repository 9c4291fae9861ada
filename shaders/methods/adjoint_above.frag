// The cotangents of what a stage of glare reads, from those of what is above the stage's threshold.
#include "lib/threshold_slope.glsl"

UNIFORM_BLOCK(STREAKS_BLOCK);

layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 2) uniform sampler2D cotangents;

#define TARGET_BINDING 5
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"

// Through above_threshold() (above.glsl).
vec4 back_above_threshold(vec4 value, vec4 cotangent)
{
    if (params.threshold <= 0.0)
        return cotangent;
    vec3 above = max(value.rgb - params.threshold, vec3(0.0));
    float most = max(above.r, max(above.g, above.b));
    float brightest = max(value.r, max(value.g, value.b)), held = max(brightest, 1e-30);
    float by_share = cotangent.a * value.a / held;
    vec3 by_above = cotangent.rgb + by_share * shares_of_brightest(value.rgb);
    float by_brightest = brightest > 1e-30 ? -by_share * most / held : 0.0;
    return vec4(by_above * larger(value, vec4(params.threshold)).rgb
                    + by_brightest * shares_of_brightest(value.rgb),
                cotangent.a * most / held);
}

vec4 shade()
{
    vec4 cotangent = texelFetch(cotangents, PIXEL, 0);
    if (ALPHA != ALPHA_BLUR)
        cotangent.a = 0.0;
    return gathered(back_above_threshold(texelFetch(source, PIXEL, 0), cotangent));
}
