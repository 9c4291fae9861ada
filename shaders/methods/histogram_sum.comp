// The sums of four bins of all tiles (histogram.comp), by a workgroup. Integers of 40 bits, in two parts, so that
// the order does not matter.
#include "lib/exposure.glsl"

layout(local_size_x = METER_SUM_INVOCATIONS) in;
SAMPLED_IMAGE(SLOT_SOURCE, source);
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

shared uvec4 lower[METER_SUM_INVOCATIONS], upper[METER_SUM_INVOCATIONS];

void main()
{
    ivec2 size = textureSize(source, 0);
    int texels = ENGINE == EXPOSURE_BEVY ? 16 : 32, across = size.x / texels;
    int four = int(gl_WorkGroupID.x), own = int(gl_LocalInvocationIndex);
    uvec4 low = uvec4(0u), high = uvec4(0u);

    for (int tile = own; tile < across * size.y; tile += METER_SUM_INVOCATIONS) {
        ivec2 at = ivec2(tile % across * texels + four, tile / across);
        low += uvec4(texelFetch(source, at, 0));
        high += low >> 16u;
        low &= 0xffffu;
    }
    lower[own] = low;
    upper[own] = high;
    barrier();
    if (own > 0)
        return;
    for (int other = 1; other < METER_SUM_INVOCATIONS; ++other) {
        low += lower[other];
        high += upper[other];
    }
    high += low >> 16u;
    low &= 0xffffu;
    vec4 sum = vec4(high) * 65536.0 + vec4(low);
    for (int bin = 0; bin < 4; ++bin)
        imageStore(target, ivec2(4 * four + bin, 0), vec4(vec3(sum[bin]), 1.0));
}
