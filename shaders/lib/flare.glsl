// What ghosts and halo see, for shaders with FLARE_BLOCK whose source has the target's size.

layout(set = 0, binding = 1) uniform sampler2D source;

// The source at an offset from the centre, in texels.
vec4 sample_from_centre(vec2 offset)
{
    vec2 place = 0.5 * vec2(textureSize(source, 0)) - 0.5 + offset;
    vec2 integer = floor(place);
    ivec2 texel = ivec2(integer);
    vec4 four[4] = vec4[4](
        fetch_inside(source, texel), fetch_inside(source, texel + ivec2(1, 0)),
        fetch_inside(source, texel + ivec2(0, 1)), fetch_inside(source, texel + ivec2(1, 1)));
    return bilinear(four, place - integer);
}

// The same with red and blue moved along the radius, above the threshold and up to the maximum.
vec4 seen_from_centre(vec2 offset)
{
    vec2 size = vec2(textureSize(source, 0)), share = offset / size;
    float distance = length(share);
    vec4 value = sample_from_centre(offset);
    if (params.aberration > 0.0 && distance > 0.0) {
        vec2 moved = params.aberration / distance * offset;
        value.r = sample_from_centre(offset - moved).r;
        value.b = sample_from_centre(offset + moved).b;
    }
    vec4 above = above_threshold(value);
    return vec4(min(above.rgb, vec3(params.maximum)), above.a);
}

// The place of this pixel, from the centre, in texels.
#define FROM_CENTRE (vec2(PIXEL) + 0.5 - 0.5 * vec2(textureSize(source, 0)))

// What a ghost shows of its sample for a place: its tints, less towards the border.
vec4 ghost_factor(int ghost, vec2 place)
{
    vec3 tint = params.ghosts[ghost].rgb;
    vec2 share = params.ghosts[ghost].w * place / vec2(textureSize(source, 0));
    float left = max(1.0 - length(share) / params.radius, 0.0);
    float weight = params.falloff > 0.0 ? pow(left, params.falloff) : 1.0;
    return weight * vec4(tint, (tint.r + tint.g + tint.b) / 3.0);
}

float vignette(vec2 place)
{
    vec2 corner = 2.0 * place / vec2(textureSize(source, 0));
    float squared = dot(corner, corner);
    return mix(1.0, min(squared * squared, 1.0), params.vignette);
}
