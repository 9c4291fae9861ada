// The samples of a blur of nine taps, and their sum, for a shader with PREFILTER_BLOCK, `source`, fullscreen.glsl and
// nine.glsl.

const ivec2 along = DIRECTION == DIRECTION_HORIZONTAL ? ivec2(1, 0) : ivec2(0, 1);

// HDRP's position of a pixel of the target. SAMPLING_TEXEL: the source is twice as large along the direction,
// which needs no division.
Place place_of(ivec2 pixel, ivec2 size)
{
    if (SAMPLING == SAMPLING_TEXEL)
        return Place(pixel * (1 + along), 0.5 * vec2(along));
    return place_in(source, pixel, size);
}

vec4 hdrp_sample(ivec2 pixel, ivec2 size)
{
    bvec2 before = lessThan(pixel, ivec2(0));
    if (FIRST_LEVEL != 0)
        return fetch_clamped(source, mix(pixel, pixel & 1, before));
    Place place = place_of(clamp(pixel, ivec2(0), size - 1), size);
    place = Place(mix(place.texel, ivec2(0), before), mix(place.part, vec2(0.0), before));
    if (SAMPLING == SAMPLING_FILTER)
        return sample_at(source, place, vec2(0.0), SAMPLING);
    // Across the direction, source and target have the same size.
    return blended(fetch_clamped(source, place.texel), fetch_clamped(source, place.texel + along),
                   dot(place.part, vec2(along)));
}

vec4 godot_sample(ivec2 pixel, ivec2 size)
{
    if (DIRECTION == DIRECTION_VERTICAL)
        return texelFetch(source, ivec2(pixel.x, paired(pixel.y, size.y)), 0);
    pixel.x = paired(pixel.x, size.x);
    return apply_point(POINT_BEFORE, sample_at(source, place_in(source, pixel, size), vec2(0.0), SAMPLING));
}

vec4 nine_sum()
{
    ivec2 size = ivec2(params.target_width, params.target_height);
    vec4 sum = vec4(0.0);
    for (int tap = -NINE_RADIUS; tap <= NINE_RADIUS; ++tap)
        sum += nine_weight(tap)
             * (IS_GODOT ? godot_sample(PIXEL + tap * along, size) : hdrp_sample(PIXEL + tap * along, size));
    return sum;
}
