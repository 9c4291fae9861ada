// KinoBloom's prefilter: the median of a texel and its neighbours, along both axes, and the soft
// threshold. Include threshold.glsl before this file.

// Selects with minimum and maximum only, since arithmetic would round.
vec4 middle(vec4 a, vec4 b, vec4 c)
{
    return max(min(a, b), min(max(a, b), c));
}

vec4 kino_limited(vec4 value)
{
    return vec4(min(value.rgb, vec3(65000.0)), value.a);
}

vec4 kino_bright(vec4 centre, vec4 left, vec4 right, vec4 up, vec4 down)
{
    vec4 kept = kino_limited(centre);
    if (ANTI_FLICKER != 0) {
        kept = middle(kept, kino_limited(left), kino_limited(right));
        kept = middle(kept, kino_limited(up), kino_limited(down));
    }
    if (THRESHOLDED != 0) {
        float width = params.threshold * params.knee + 1e-5;
        kept = soft_threshold(kept, params.threshold, width, 4.0 * width, 1e-5);
    }
    return kept;
}
