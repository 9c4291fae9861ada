// What ghosts and halo see, for shaders with FLARE_BLOCK whose source has the target's size.

layout(set = 0, binding = 1) uniform sampler2D source;

// The source at an offset from the centre, in texels. The offset is not added to the size of the image first,
// which would round it.
vec4 sample_from_centre(vec2 offset)
{
    vec2 centre = 0.5 * vec2(textureSize(source, 0)) - 0.5, start = floor(centre);
    vec2 moved = centre - start + offset, integer = floor(moved);
    return bilinear(fetch_four_inside(source, ivec2(start + integer)), moved - integer);
}

// The same with red and blue moved along the radius.
vec4 colours_from_centre(vec2 offset)
{
    vec4 value = sample_from_centre(offset);
    float distance = length(offset / vec2(textureSize(source, 0)));
    if (params.aberration > 0.0 && distance > 0.0) {
        vec2 moved = params.aberration / distance * offset;
        value.r = sample_from_centre(offset - moved).r;
        value.b = sample_from_centre(offset + moved).b;
    }
    return value;
}

// The same above the threshold and up to the maximum.
vec4 seen_from_centre(vec2 offset)
{
    vec4 above = colours_from_centre(offset);
    if (params.threshold > 0.0)
        above = part_above(above, params.threshold);
    return vec4(min(above.rgb, vec3(params.maximum)), above.a);
}

// The place of this pixel, from the centre, in texels.
#define FROM_CENTRE (vec2(PIXEL) + 0.5 - 0.5 * vec2(textureSize(source, 0)))
