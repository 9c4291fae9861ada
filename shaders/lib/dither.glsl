// Noise before the rounding to 8 bits, so that a dark gradient shows grain instead of bands.

// A hash from three 32-bit integers to three: pcg3d of Jarzynski and Olano, "Hash Functions for GPU
// Rendering", JCGT 9(3), 2020. Integer arithmetic is the same on every device.
uvec3 hash(uvec3 v)
{
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> 16;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return v;
}

// Adds uniform noise of +-1/2 level to each channel and rounds to k / 255. The mean of the result is
// the value (Roberts, "Picture Coding Using Pseudo-Random Noise", 1962). Values that 8 bits hold,
// such as 0 and 1, do not change: the noise has 12 bits, so that its ends are farther from the
// rounding boundary than the error of a float near 255.
vec3 dithered(vec3 value, ivec2 pixel, int seed)
{
    vec3 noise = (vec3(hash(uvec3(pixel, seed)) >> 20) + 0.5) / 4096.0;
    return floor(clamp(value, 0.0, 1.0) * 255.0 + noise) / 255.0;
}
