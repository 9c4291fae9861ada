// The histogram of a tile of samples, by a workgroup. Its counts are less than 2^24: single floats hold them. The
// tile at (x, y) has the texels from (x * bins / 4, y) on, four bins in each.
#include "lib/exposure.glsl"

layout(local_size_x = METER_INVOCATIONS, local_size_y = METER_INVOCATIONS) in;
SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_METER_MASK, meter_mask);
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

#include "lib/sampling.glsl"

shared uint counts[METER_BINS];

vec3 corner(ivec2 at)
{
    return 0.25 * (fetch_clamped(source, at - ivec2(1, 1)).rgb + fetch_clamped(source, at - ivec2(0, 1)).rgb
                   + fetch_clamped(source, at - ivec2(1, 0)).rgb + fetch_clamped(source, at).rgb);
}

int bin_of(float light)
{
    if (ENGINE == EXPOSURE_BEVY) {
        if (!is_nan(light) && light < exp2(params.low))
            return 0;
        return int(1.0 + 62.0 * saturate((logarithm(light) - params.low) / (params.high - params.low)));
    }
    float value = ENGINE == EXPOSURE_HDRP ? ev100(light) : logarithm(light);
    return int(127.0 * saturate((value - params.low) / (params.high - params.low)));
}

float mask_at(ivec2 at, ivec2 size)
{
    if (params.masked == 0.0)
        return 1.0;
    ivec2 texels = textureSize(meter_mask, 0);
    if (ENGINE == EXPOSURE_BEVY)
        return texelFetch(meter_mask, at * texels / size, 0).r;
    vec2 place = vec2(at) / vec2(size) * vec2(texels) - 0.5, first = floor(place);
    return fetch_bilinear(meter_mask, ivec2(first), place - first).r;
}

int count_of(ivec2 at, ivec2 size, float light)
{
    if (ENGINE == EXPOSURE_PPV2) {
        vec2 away = vec2(at) / vec2(size) - 0.5;
        float vignette = saturate(1.0 - away.x * away.x - away.y * away.y);
        return int(64.0 * (vignette * vignette));
    }
    float masked = mask_at(at, size);
    return ENGINE == EXPOSURE_BEVY ? int(16.0 * masked)
                                   : int(2048.0 * weight_at(vec2(at), vec2(size), light, masked));
}

void add_sample(ivec2 at, ivec2 size)
{
    if (any(greaterThanEqual(at, size)))
        return;
    float light = luminance(ENGINE == EXPOSURE_PPV2 ? corner(at) : texelFetch(source, at, 0).rgb);
    int count = count_of(at, size, light);
    if (count > 0)
        atomicAdd(counts[bin_of(light)], uint(count));
}

void main()
{
    ivec2 size = textureSize(source, 0), tile = ivec2(gl_WorkGroupID.xy);
    int apart = ENGINE == EXPOSURE_BEVY ? 1 : 2, texels = ENGINE == EXPOSURE_BEVY ? 16 : 32;
    int own = int(gl_LocalInvocationIndex);

    for (int bin = own; bin < METER_BINS; bin += METER_INVOCATIONS * METER_INVOCATIONS)
        counts[bin] = 0u;
    barrier();
    for (int y = int(gl_LocalInvocationID.y); y < METER_TILE; y += METER_INVOCATIONS)
        for (int x = int(gl_LocalInvocationID.x); x < METER_TILE; x += METER_INVOCATIONS)
            add_sample((tile * METER_TILE + ivec2(x, y)) * apart, size);
    barrier();
    if (own < texels) {
        int bin = 4 * own;
        uvec4 four = uvec4(counts[bin], counts[bin + 1], counts[bin + 2], counts[bin + 3]);
        imageStore(target, ivec2(tile.x * texels + own, tile.y), vec4(four));
    }
}
