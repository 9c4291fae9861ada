// Spectra whose frequencies are in the order of stages, with two channels in each complex number. Include
// lib/complex.glsl first.

// The frequency at a place, and the place of a frequency: digits of the radices a to d.
int frequency_at(int place, ivec4 radices)
{
    int w = quotient(place, radices.w), z = quotient(w, radices.z), y = quotient(z, radices.y);
    int frequency = place - w * radices.w;
    frequency = frequency * radices.z + w - z * radices.z;
    frequency = frequency * radices.y + z - y * radices.y;
    return frequency * radices.x + y;
}

// The place of the frequency with the opposite sign.
int mirrored(int place, ivec4 radices, int length)
{
    int frequency = frequency_at(place, radices);
    return frequency == 0 ? 0 : frequency_at(length - frequency, radices.wzyx);
}

// `value` is the spectrum of two real channels, the second one times i; so is `kernel`. Returns the
// spectrum of both products. The mirrors are the values at the frequency with the opposite sign.
vec2 channels(vec2 value, vec2 mirror, vec2 kernel, vec2 kernel_mirror)
{
    vec2 a = conjugate(mirror), b = conjugate(kernel_mirror);
    vec2 first = product(0.5 * (value + a), 0.5 * (kernel + b));
    // Both factors are i times the spectrum of the second channel: i x i y = i (i x y).
    vec2 second = product(0.5 * (value - a), 0.5 * (kernel - b));
    return first + vec2(second.y, -second.x);
}

vec4 channels(vec4 value, vec4 mirror, vec4 kernel, vec4 kernel_mirror)
{
    return vec4(channels(value.xy, mirror.xy, kernel.xy, kernel_mirror.xy),
                channels(value.zw, mirror.zw, kernel.zw, kernel_mirror.zw));
}
