// What exposures meter. Comparisons with NaN are false, so that it becomes the lower limit; the bits are tested
// where an engine tests for NaN.

UNIFORM_BLOCK(EXPOSURE_BLOCK);

#define ENGINE_CONSTANT(name, value, spelling, bins, apart, exposes) const int name = value;
EXPOSURES(ENGINE_CONSTANT)

bool is_number(float value)
{
    return (floatBitsToUint(value) & 0x7f800000u) != 0x7f800000u;
}

bool is_nan(float value)
{
    return (floatBitsToUint(value) & 0x7fffffffu) > 0x7f800000u;
}

// NaN becomes `low`.
float limit(float value, float low, float high)
{
    return is_nan(value) ? low : min(max(value, low), high);
}

float saturate(float value)
{
    return limit(value, 0.0, 1.0);
}

// The larger number; NaN if there is none.
float larger_number(float a, float b)
{
    return is_nan(a) ? b : is_nan(b) ? a : max(a, b);
}

// log2(), whose results for infinity, NaN and negative numbers are the driver's.
float logarithm(float value)
{
    if (is_nan(value) || value < 0.0)
        return uintBitsToFloat(0x7fc00000u);
    if (value == 0.0)
        return uintBitsToFloat(0xff800000u);
    return is_number(value) ? log2(value) : value;
}

float brightest(vec3 colour)
{
    return larger_number(colour.r, larger_number(colour.g, colour.b));
}

float luminance(vec3 colour)
{
    vec3 weights = ENGINE == EXPOSURE_BEVY ? vec3(0.2125, 0.7154, 0.0721)
                 : ENGINE == EXPOSURE_O3DE ? vec3(0.27222872, 0.67408168, 0.05368952)
                                           : vec3(0.2126729, 0.7151522, 0.0721750);
    return colour.r * weights.r + colour.g * weights.g + colour.b * weights.b;
}

float ev100(float light)
{
    return logarithm(100.0 * light / params.grey);
}

// How much HDRP counts a pixel of a grid of that size, whose light this is. `masked` is the mask there.
float weight_at(vec2 at, vec2 size, float light, float masked)
{
    int metering = int(params.metering);
    float from_centre = length(at - 0.5 * size), side = 0.5 * (size.x + size.y);
    if (metering == METERING_SPOT)
        return 1.0 - saturate(from_centre - 0.075 * side);
    if (metering == METERING_CENTER)
        return 1.0 - saturate(from_centre / side);
    if (metering == METERING_MASK)
        return masked;
    if (metering == METERING_PROCEDURAL) {
        vec2 radii = vec2(params.radius_x, params.radius_y) * size;
        float radius = max(radii.x, radii.y);
        vec2 away = (at - vec2(params.centre_x, params.centre_y) * size) * (radius / radii);
        float share = length(away) / radius;
        float weight = saturate(1.0 - (share > 0.0 ? pow(share, params.power) : 0.0));
        return light > params.least && light < params.most ? weight : 0.0;
    }
    return 1.0;
}
