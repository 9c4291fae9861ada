// Texels that a filter, or its transpose, adds up along one axis.

#ifndef WINDOW_WEIGHTS
#define WINDOW_WEIGHTS (MAX_WINDOW + 2)
#endif

// Adjacent texels, of which `first` is the first one, and their weights in each kernel.
struct Window {
    int first;
    vec3 weights[WINDOW_WEIGHTS];
};

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
