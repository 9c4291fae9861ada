// Godot's blend modes, for shaders with GODOT_FINAL_BLOCK that include composite.glsl.

// What the brightest light makes of a colour.
vec3 soft_full(vec3 s)
{
    // Limited from below, since infinity times 0 is NaN.
    vec3 low = max(s, -1e6);
    vec3 dark = ((16.0 * low - 12.0) * low + 4.0) * low;
    return mix(sqrt(max(s, 0.0)), dark, lessThanEqual(s, vec3(0.25)));
}

vec3 soft_light(vec3 s, vec3 light)
{
    return mix(s + clamp(light, 0.0, 1.0) * (soft_full(s) - s), s, greaterThan(s, vec3(1.0)));
}

// Before the tone map, of all modes but soft light.
vec3 blended_sum(vec3 s, vec3 bloom_light, float share)
{
    vec3 light = light_of(bloom_light), sum = s + light;
    if (COMPOSITE == COMPOSITE_MIX)
        sum = mixed(s, bloom_light, share);
    if (COMPOSITE == COMPOSITE_REPLACE)
        sum = light;
    if (COMPOSITE == COMPOSITE_SCREEN) {
        vec3 part = clamp(light / params.white, 0.0, 1.0);
        sum = s + (params.white - s) * part;
    }
    return sum;
}

vec3 blend(vec3 s, vec3 bloom_light, float share)
{
    if (COMPOSITE == COMPOSITE_SOFT_LIGHT)
        return soft_light(apply_tonemap(s, TONEMAP), apply_tonemap(light_of(bloom_light), TONEMAP));
    return apply_tonemap(blended_sum(s, bloom_light, share), TONEMAP);
}
