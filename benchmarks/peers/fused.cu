// The bloom of an image in one kernel: hard luminance threshold, vertical and horizontal blur, sum.
// It is only a peer for benchmarks; vkbloom does not use it.
//
// A block computes TILE_X x TILE_Y pixels. First each thread processes a strip of STRIP rows. It
// keeps the window of the vertical blur in registers and writes the column to shared memory. Then
// the threads blur along the rows. In both steps the threads of a warp are adjacent in x.

#define TAPS (2 * RADIUS + 1)
#define COLUMNS (TILE_X + 2 * RADIUS)
#define THREADS (COLUMNS * (TILE_Y / STRIP))

__constant__ float weights[RADIUS + 1];

struct Colour {
    float r, g, b;
};

// Conversions by instruction, so that no header is needed.
__device__ __forceinline__ float to_float(unsigned int half_bits)
{
    float value;
    asm("cvt.f32.f16 %0, %1;" : "=f"(value) : "h"((unsigned short)half_bits));
    return value;
}

__device__ __forceinline__ unsigned int to_half(float value)
{
    unsigned short half_bits;
    asm("cvt.rn.f16.f32 %0, %1;" : "=h"(half_bits) : "f"(value));
    return half_bits;
}

__device__ __forceinline__ Colour unpack(uint2 pixel)
{
    return {to_float(pixel.x & 0xffff), to_float(pixel.x >> 16), to_float(pixel.y & 0xffff)};
}

__device__ __forceinline__ uint2 pack(Colour c, unsigned int alpha_bits)
{
    return make_uint2(to_half(c.r) | to_half(c.g) << 16, to_half(c.b) | alpha_bits);
}

__device__ __forceinline__ void add(Colour &sum, float weight, Colour c)
{
    sum.r += weight * c.r;
    sum.g += weight * c.g;
    sum.b += weight * c.b;
}

__device__ __forceinline__ Colour glow(uint2 pixel, float threshold)
{
    Colour c = unpack(pixel);
    float luminance = 0.2126f * c.r + 0.7152f * c.g + 0.0722f * c.b;
    return luminance > threshold ? c : Colour{0.0f, 0.0f, 0.0f};
}

extern "C" __global__ void __launch_bounds__(THREADS)
    bloom(const uint2 *__restrict__ source, uint2 *__restrict__ target, int width, int height,
          float threshold)
{
    __shared__ uint2 columns[TILE_Y][COLUMNS];
    int left = blockIdx.x * TILE_X, top = blockIdx.y * TILE_Y;

    int column = threadIdx.x % COLUMNS, first = threadIdx.x / COLUMNS * STRIP;
    int x = min(max(left + column - RADIUS, 0), width - 1);
    Colour window[STRIP + 2 * RADIUS];
#pragma unroll
    for (int i = 0; i < STRIP + 2 * RADIUS; ++i) {
        int y = min(max(top + first + i - RADIUS, 0), height - 1);
        window[i] = glow(__ldg(&source[y * width + x]), threshold);
    }
#pragma unroll
    for (int i = 0; i < STRIP; ++i) {
        Colour sum = {0.0f, 0.0f, 0.0f};
#pragma unroll
        for (int tap = -RADIUS; tap <= RADIUS; ++tap)
            add(sum, weights[tap < 0 ? -tap : tap], window[i + RADIUS + tap]);
        columns[first + i][column] = pack(sum, 0);
    }
    __syncthreads();

    for (int i = threadIdx.x; i < TILE_X * TILE_Y; i += THREADS) {
        int across = i % TILE_X, down = i / TILE_X;
        if (left + across >= width || top + down >= height)
            continue;
        size_t place = (size_t)(top + down) * width + left + across;
        uint2 pixel = __ldg(&source[place]);
        Colour sum = unpack(pixel);
#pragma unroll
        for (int tap = 0; tap < TAPS; ++tap)
            add(sum, weights[tap < RADIUS ? RADIUS - tap : tap - RADIUS],
                unpack(columns[down][across + tap]));
        target[place] = pack(sum, pixel.y & 0xffff0000u);
    }
}
