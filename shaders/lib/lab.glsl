// Lightness of CIE Lab, D50, of linear Rec. 709, as darktable converts it: XYZ over its white, and back.
const mat3 WHITE_SHARES = mat3(0.45225644, 0.39935378, 0.14838979, 0.2225045, 0.7168786, 0.0606169,
                               0.01688322, 0.11767247, 0.86544431);
const mat3 COLOUR_SHARES = mat3(3.02172699, -1.61686677, -0.40486022, -0.94374822, 1.91614155,
                                0.02760667, 0.06937097, -0.22899128, 1.15962031);
const float LAB_SLOPE = 24389.0 / 27.0;

vec3 lab_of(vec3 colour)
{
    vec3 t = colour * WHITE_SHARES;
    return mix((LAB_SLOPE * t + 16.0) / 116.0, pow(max(t, 1e-30), vec3(1.0 / 3.0)),
               greaterThan(t, vec3(216.0 / 24389.0)));
}

// The slope of each channel by the share of white that it is of.
vec3 lab_slope(vec3 colour)
{
    vec3 t = colour * WHITE_SHARES;
    return mix(vec3(LAB_SLOPE / 116.0), pow(max(t, 1e-3), vec3(-2.0 / 3.0)) / 3.0,
               greaterThan(t, vec3(216.0 / 24389.0)));
}

float lightness_of(vec3 colour)
{
    return 116.0 * lab_of(colour).y - 16.0;
}

// A colour whose lightness is the screen of its own and of light (from 0 to 1), with its a and b.
vec3 lightness_screen(vec3 colour, float light)
{
    vec3 f = lab_of(colour);
    f += light * (116.0 - 116.0 * f.y) / 116.0;
    vec3 t = mix((116.0 * f - 16.0) / LAB_SLOPE, f * f * f, greaterThan(f, vec3(6.0 / 29.0)));
    return t * COLOUR_SHARES;
}

// Cotangents of the result to those of the colour and, in alpha, of the light.
vec4 back_lightness_screen(vec3 colour, float light, vec3 cotangent)
{
    vec3 own = lab_of(colour), f = own + light * (1.0 - own.y);
    vec3 by = COLOUR_SHARES * cotangent
            * mix(vec3(116.0 / LAB_SLOPE), 3.0 * f * f, greaterThan(f, vec3(6.0 / 29.0)));
    float sum = by.x + by.y + by.z;
    by.y -= light * sum;
    return vec4(WHITE_SHARES * (by * lab_slope(colour)), (1.0 - own.y) * sum);
}
