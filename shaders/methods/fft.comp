#pragma compile images
// One stage of a Fourier transform along one axis: a butterfly of RADIX_A * RADIX_B elements, `step`
// apart, for each invocation. A texel is two complex numbers: red and green, blue and alpha. The way
// forth decimates in frequency: results stay where their elements were, so that frequencies end with
// their digits reversed. The way back does the stages the other way round, and needs no reordering.
//
// STAGE_FIRST reads the glow, STAGE_LAST stores to an image of the bloom's format. STAGE_GREY and
// STAGE_COLOURS are the last stage forth along columns, the product with the kernel's spectrum and the
// first stage back. PADDED reads what lies beyond the source's edges by the boundary.

UNIFORM_BLOCK(FFT_BLOCK);
#ifndef TARGET_BYTES
#define TARGET_BYTES 4
#endif
#ifdef LINEAR_TEXELS
#include "variants/pixels.glsl"
#else
#define READ_IMAGE(number, name) \
    layout(set = 0, binding = number, SOURCE_FORMAT) uniform readonly image2D name
#endif
#include "lib/fourier.glsl"

layout(local_size_x_id = 34, local_size_y_id = 35) in;
READ_IMAGE(1, source);
READ_IMAGE(2, factor);
#ifndef LINEAR_TEXELS
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;
#elif TARGET_BYTES == 4
layout(set = 0, binding = TARGET_BINDING, std430) writeonly buffer Target { uvec4 texels[]; } target;
#elif TARGET_BYTES == 2
layout(set = 0, binding = TARGET_BINDING, std430) writeonly buffer Target { uvec2 texels[]; } target;
#else
layout(set = 0, binding = TARGET_BINDING, std430) writeonly buffer Target { uint texels[]; } target;
#endif

const int RADIX = RADIX_A * RADIX_B;

ivec2 texel_at(int along, int across)
{
    return DIRECTION == DIRECTION_HORIZONTAL ? ivec2(along, across) : ivec2(across, along);
}

vec4 load_source(ivec2 at)
{
#ifdef LINEAR_TEXELS
    return load_pixel(source, shapes.reads[0], at.x, at.y);
#else
    return imageLoad(source, at);
#endif
}

vec4 load_factor(ivec2 at)
{
#ifdef LINEAR_TEXELS
    return uintBitsToFloat(texelFetch(factor, at.y * shapes.reads[1].z + at.x));
#else
    return imageLoad(factor, at);
#endif
}

void store(ivec2 at, vec4 value)
{
#ifndef LINEAR_TEXELS
    imageStore(target, at, value);
#elif TARGET_BYTES == 4
    // (Without the maximum LLVM packs lane by lane.)
    target.texels[at.y * shapes.target.z + at.x] = max(floatBitsToUint(value), uvec4(shapes.reads[0].w));
#elif TARGET_BYTES == 2
    uvec2 bits = uvec2(packHalf2x16(value.rg), packHalf2x16(value.ba));
    target.texels[2 * at.y * shapes.target.z + at.x] = max(bits, uvec2(shapes.reads[0].w));
#else
    // A sum with 2^23 is rounded to an integer, which its last bits are.
    uvec4 level = floatBitsToUint(value * 255.0 + 8388608.0) & 255u;
    target.texels[4 * at.y * shapes.target.z + at.x] =
        level.r | level.g << 8 | level.b << 16 | level.a << 24;
#endif
}

#include "lib/padded.glsl"

int place_of(int q)
{
    return place_of(q, RADIX_A, RADIX_B);
}

void transform_held(bool inverse)
{
    transform_held(RADIX_A, RADIX_B, inverse);
}

// exp(-2 pi i k q / n), or its inverse, for q of 0 to RADIX - 1.
vec2 turns[FFT_MAX_RADIX];

void compute_turns(int k, int n, bool inverse)
{
    vec2 one = turn(k, n);
    turns[0] = vec2(1.0, 0.0);
    turns[1] = inverse ? conjugate(one) : one;
    [[unroll]] for (int q = 2; q < RADIX; ++q)
        turns[q] = product(turns[q / 2], turns[q - q / 2]);
}

void load_line(int first, int across)
{
    [[unroll]] for (int i = 0; i < RADIX; ++i)
        held[i] = load(first + i * params.step, across);
}

void store_line(int first, int across)
{
    [[unroll]] for (int i = 0; i < RADIX; ++i) {
        int along = first + i * params.step;
        vec4 value = held[place_of(i)];
        if (along < params.kept)
            store(texel_at(along, across), STAGE == STAGE_LAST ? stored(value) : value);
    }
}

void multiply_grey(int first, int across)
{
    vec4 values[FFT_MAX_RADIX];
    [[unroll]] for (int i = 0; i < RADIX; ++i)
        values[i] = rotated(held[place_of(i)], load_factor(texel_at(first + i, across)).xy);
    [[unroll]] for (int i = 0; i < RADIX; ++i)
        held[i] = values[i];
}

// The frequency at a place, and the place of a frequency: digits of the radices a to d.
int frequency_at(int place, ivec4 radices)
{
    int frequency = place % radices.w;
    place /= radices.w;
    frequency = frequency * radices.z + place % radices.z;
    place /= radices.z;
    frequency = frequency * radices.y + place % radices.y;
    return frequency * radices.x + place / radices.y;
}

int place_at(int frequency, ivec4 radices)
{
    return frequency_at(frequency, radices.wzyx);
}

// The place of the frequency with the opposite sign.
int mirrored(int place, ivec4 radices, int length)
{
    int frequency = frequency_at(place, radices);
    return frequency == 0 ? 0 : place_at(length - frequency, radices);
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

// Multiplies by a kernel with colours. The product at a frequency needs the spectra at the frequency
// with the opposite sign, so that an invocation computes the lines of both. The dispatch leaves most of
// the second lines out; invocations for the others return at once.
void multiply_colours(int number, int index)
{
    ivec4 rows = ivec4(params.row_a, params.row_b, params.row_c, params.row_d);
    // The numbers of the blocks before this last stage have reversed digits, too.
    ivec4 blocks =
        ivec4(params.block_a, params.block_b, params.block_c, 1);
    int run = params.row_last / 2 + 1;
    int across = index / run * params.row_last + index % run;
    int other_across = mirrored(across, rows, params.row_length);
    int other_number = mirrored(number, blocks, params.count);
    int frequency = frequency_at(across, rows), other = (params.row_length - frequency) % params.row_length;
    bool own = number == 0;
    vec4 values[FFT_MAX_RADIX], others[FFT_MAX_RADIX];

    if (frequency > other || (frequency == other && number > other_number))
        return;
    load_line(number * RADIX, across);
    transform_held(false);
    [[unroll]] for (int i = 0; i < RADIX; ++i)
        values[i] = held[place_of(i)];
    load_line(other_number * RADIX, other_across);
    transform_held(false);
    // In the block of frequency 0, the opposite frequency is in the same block.
    [[unroll]] for (int i = 0; i < RADIX; ++i) {
        int j = RADIX - 1 - i, own_j = (RADIX - i) % RADIX;
        vec4 mirror = own ? held[place_of(own_j)] : held[place_of(j)];
        vec4 kernel = load_factor(texel_at(number * RADIX + i, across));
        vec4 kernel_mirror =
            load_factor(texel_at(other_number * RADIX + (own ? own_j : j), other_across));
        others[i] = channels(mirror, values[i], kernel_mirror, kernel);
        values[i] = channels(values[i], mirror, kernel, kernel_mirror);
    }
    [[unroll]] for (int i = 0; i < RADIX; ++i)
        held[i] = values[i];
    transform_held(true);
    store_line(number * RADIX, across);
    [[unroll]] for (int i = 0; i < RADIX; ++i)
        held[i] = own ? others[(RADIX - i) % RADIX] : others[RADIX - 1 - i];
    transform_held(true);
    store_line(other_number * RADIX, other_across);
}

void rotate(int x, bool inverse)
{
    compute_turns(x, params.step * RADIX, inverse);
    [[unroll]] for (int i = 1; i < RADIX; ++i) {
        int at = inverse ? i : place_of(i);
        held[at] = rotated(held[at], turns[i]);
    }
}

void main()
{
    ivec2 id = ivec2(gl_GlobalInvocationID.xy);
    bool horizontal = DIRECTION == DIRECTION_HORIZONTAL;
    int number = horizontal ? id.x : id.y, across = horizontal ? id.y : id.x;
    if (number >= params.count || across >= params.across)
        return;
    if (STAGE == STAGE_COLOURS) {
        multiply_colours(number, across);
        return;
    }
    int block = number / params.step, x = number - block * params.step;
    int first = block * params.step * RADIX + x;
    load_line(first, across);
    if (INVERSE != 0 && ROTATED != 0)
        rotate(x, true);
    transform_held(INVERSE != 0);
    if (INVERSE == 0 && ROTATED != 0)
        rotate(x, false);
    if (STAGE == STAGE_GREY) {
        multiply_grey(first, across);
        transform_held(true);
    }
    store_line(first, across);
}
