// Noise that turns the rounding to 8 bits into grain, which keeps a dark gradient from showing as
// bands.

// Three numbers of 32 bits that depend on three: pcg3d of Jarzynski and Olano, "Hash Functions for
// GPU Rendering", JCGT 9(3), 2020. Whole numbers, so it is the same on every device.
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

// Rounded to k / 255 after uniform noise of one level, +-1/2, each channel its own: the mean of the
// result is the value (Roberts, "Picture Coding Using Pseudo-Random Noise", 1962), and values that
// 8 bits hold, 0 and 1 among them, stay. The noise has 12 bits, so that its ends are clear of what
// a float of 255 is off by.
vec3 dithered(vec3 value, ivec2 pixel, int seed)
{
    vec3 noise = (vec3(hash(uvec3(pixel, seed)) >> 20) + 0.5) / 4096.0;
    return floor(clamp(value, 0.0, 1.0) * 255.0 + noise) / 255.0;
}
