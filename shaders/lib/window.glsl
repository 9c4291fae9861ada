// Texels that a filter, or its transpose, adds up along one axis.

#ifndef WINDOW_WEIGHTS
#define WINDOW_WEIGHTS (MAX_WINDOW + 2)
#endif

// Adjacent texels, of which `first` is the first one, and their weights in each kernel.
struct Window {
    int first;
    vec3 weights[WINDOW_WEIGHTS];
};

// How far the window of a pixel is from that of the first one, if sides are in this simple ratio.
int offset_of(int exact, int pixel)
{
    return exact == EXACT_HALF ? 2 * pixel : exact == EXACT_SAME ? pixel : (pixel + 1) / 2;
}

// The first texel of the window of a pixel, which has an even number of texels if the sides are not the same.
int first_texel(int exact, int pixel, int window)
{
    return offset_of(exact, pixel) - (exact == EXACT_DOUBLE ? window : window - 1) / 2;
}

// Whether a texel of a window may have a weight in a kernel, by TAKEN_X or TAKEN_Y.
bool has_weight(int taken, int at, int kernel)
{
    return taken == 0 || (taken >> (MAX_WINDOW * kernel + at) & 1) != 0;
}

vec4 sum_of(vec4 sums[3])
{
    vec4 sum = sums[0];
    [[unroll]] for (int kernel = 1; kernel < KERNELS; ++kernel)
        sum += sums[kernel];
    return sum;
}
