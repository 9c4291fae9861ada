// What ghosts and halo see, for shaders with FLARE_BLOCK whose source has the target's size.

SAMPLED_IMAGE(SLOT_SOURCE, source);

// The place at an offset from the centre, in texels. The offset is not added to the size of the image first,
// which would round it.
Place place_from_centre(vec2 offset)
{
    vec2 centre = 0.5 * vec2(textureSize(source, 0)) - 0.5, start = floor(centre);
    vec2 moved = centre - start + offset, integer = floor(moved);
    return Place(ivec2(start + integer), moved - integer);
}

vec4 sample_from_centre(vec2 offset)
{
    Place place = place_from_centre(offset);
    return bilinear_inside(source, place.texel, place.part);
}

// Whether red (-1) and blue (1) are sampled at other places than green, and the place of each. A constant decides, since
// llvmpipe runs both sides of an `if`: with a parameter `blender_ghosts` takes 1,010 ms in place of 580 (processor time of
// 1920 x 1080, lavapipe of Mesa 22.3.6, 2026-11-29).
bool is_aberrated(vec2 offset)
{
    return ABERRATED != 0 && length(offset / vec2(textureSize(source, 0))) > 0.0;
}

vec2 aberrated(vec2 offset, float side)
{
    float distance = length(offset / vec2(textureSize(source, 0)));
    return offset + side * (params.aberration / distance * offset);
}

// The source with red and blue moved along the radius.
vec4 colours_from_centre(vec2 offset)
{
    vec4 value = sample_from_centre(offset);
    if (is_aberrated(offset)) {
        value.r = sample_from_centre(aberrated(offset, -1.0)).r;
        value.b = sample_from_centre(aberrated(offset, 1.0)).b;
    }
    return value;
}

// The same above the threshold and up to the maximum.
vec4 seen_from_centre(vec2 offset)
{
    vec4 above = colours_from_centre(offset);
    if (PART_ABOVE != 0)
        above = part_above(above, params.threshold);
    return vec4(min(above.rgb, vec3(params.maximum)), above.a);
}

// The place of this pixel, from the centre, in texels.
#define FROM_CENTRE (vec2(PIXEL) + 0.5 - 0.5 * vec2(textureSize(source, 0)))

// What a halo samples for a place, and what it shows of it. The direction must be exact, since red and blue are moved
// along it also where the sample is near the centre.
vec2 halo_offset(vec2 place)
{
    float distance = length(place);
    float height = float(textureSize(source, 0).y);
    return distance > 0.0 ? (distance - params.radius * height) / distance * place : vec2(0.0);
}

float halo_factor(vec2 place)
{
    float height = float(textureSize(source, 0).y), distance = length(place);
    return 1.0 - smoothstep(0.0, 1.0, abs(distance / height - params.radius) / params.width);
}

// What a ghost shows of its sample for a place: its tints, less towards the border. A power of 1 is exact, as the host
// has it (csrc/passes/host_ghosts.c), which powers of llvmpipe are not.
vec4 ghost_factor(vec4 ghost, vec2 place)
{
    vec2 share = ghost.w * place / vec2(textureSize(source, 0));
    float left = max(1.0 - length(share) / params.radius, 0.0);
    float weight = params.falloff == 1.0 ? left : params.falloff > 0.0 ? pow(left, params.falloff) : 1.0;
    return weight * vec4(ghost.rgb, (ghost.r + ghost.g + ghost.b) / 3.0);
}

// What all ghosts show in the corners.
float corner_factor(vec2 place)
{
    vec2 corner = 2.0 * place / vec2(textureSize(source, 0));
    float squared = dot(corner, corner);
    return mix(1.0, min(squared * squared, 1.0), params.vignette);
}

// Of a halo, which has no ghosts, or of the first ghost: what it samples for a place.
vec2 flare_offset(vec2 place)
{
    return params.count == 0 ? halo_offset(place) : params.ghosts[0].w * place;
}
