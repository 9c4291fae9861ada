// A Fourier transform along one axis. A texel is two complex numbers: red and green, blue and alpha.
//
// A pass is one stage: a butterfly of RADIX_1 elements, `step` apart, for each invocation. The way forth
// decimates in frequency: results stay where their elements were, so that frequencies end with their
// digits reversed. The way back does the stages the other way round, and needs no reordering.
//
// STAGE_FIRST reads the glow, STAGE_LAST stores to an image of the bloom's format. STAGE_PRODUCT is the
// last stage forth along columns, the product with the kernel's spectrum and the first stage back; so is
// STAGE_GREY, with a grey kernel. On the way back the product comes first.
// PADDED reads what lies beyond the source's edges by the boundary.

#define ELEMENT vec4
UNIFORM_BLOCK(FFT_BLOCK);
#include "lib/fourier.glsl"
#include "lib/frequencies.glsl"
#include "lib/padded.glsl"

layout(local_size_x_id = 34, local_size_y_id = 35) in;
LOADED_IMAGE(SLOT_SPECTRUM, factor, rgba32f);
LOADED_IMAGE(SLOT_ADDED, added, rgba32f);
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

// The place of element i of a butterfly, before and after the pass.
int place_at(int number, int i)
{
    int block = quotient(number, params.step);
    return number + block * params.step * (RADIX_1 - 1) + i * params.step;
}

// Multiplies the elements of a butterfly, or its results, by what its place in the line turns them.
void rotate(int number, bool inverse, bool results)
{
    vec2 turns[FFT_MAX_RADIX];
    find_turns(RADIX_1, float(number % params.step), params.step * RADIX_1, turns);
    [[unroll]] for (int q = 1; q < RADIX_1; ++q) {
        int at = results ? place_of(q, RADIX_1) : q;
        held[at] = rotated(held[at], inverse ? conjugate(turns[q]) : turns[q]);
    }
}

void transform_forth(int number)
{
    transform_held(RADIX_1, false);
    if (ROTATED != 0)
        rotate(number, false, true);
}

void transform_back(int number)
{
    if (ROTATED != 0)
        rotate(number, true, false);
    transform_held(RADIX_1, true);
}

void load_line(int number, int across)
{
    [[unroll]] for (int i = 0; i < RADIX_1; ++i)
        held[i] = load(place_at(number, i), across);
}

// Multiplies a line that came back by weights, and adds another image's.
void add_weighted(int number, int across)
{
    [[unroll]] for (int i = 0; i < RADIX_1; ++i) {
        int along = min(place_at(number, i), params.kept - 1), at = place_of(i, RADIX_1);
        ivec2 place = texel_at(along, across) - ivec2(params.before_x, params.before_y);
        if (WEIGHTED != 0)
            held[at] *= IS_ROW ? weight_at(place.x, place.y) : weight_at(place.y, 0);
        if (ADDS_IMAGE != 0)
            held[at] += imageLoad(added, texel_at(along, across));
    }
}

// Whether the invocation stores nothing. None returns: after a return Mesa 22.3 loads parameters lane by lane.
bool idle;

void store_line(int number, int across)
{
    if (idle)
        return;
    [[unroll]] for (int i = 0; i < RADIX_1; ++i) {
        int along = place_at(number, i);
        vec4 value = held[place_of(i, RADIX_1)];
        if (along < params.kept)
            imageStore(target, texel_at(along, across), STAGE == STAGE_LAST ? stored(value) : value);
    }
}

// A product of both complex numbers at a frequency with a grey kernel's. Without it a convolution of 960 x 540 takes 40 ms
// in place of 30, its first call 1.8 s in place of 1.5, with Mesa 25.0.7 4.0 s in place of 3.2 (processor time, lavapipe of
// Mesa 22.3.6, 2026-11-28).
void multiply_each(int number, int across)
{
    vec4 values[FFT_MAX_RADIX];
    vec4 signs = vec2(1.0, params.kernel_sign).xyxy;
    [[unroll]] for (int i = 0; i < RADIX_1; ++i) {
        vec4 value = held[INVERSE != 0 ? i : place_of(i, RADIX_1)];
        vec4 by = signs * imageLoad(factor, ivec2(across, place_at(number, i)));
        values[i] = vec4(product(value.xy, by.xy), product(value.zw, by.zw));
    }
    [[unroll]] for (int i = 0; i < RADIX_1; ++i)
        held[i] = values[i];
}

// Multiplies by the kernel, whose spectrum has two channels in each complex number, too. The product at a
// frequency needs the spectra at the frequency with the opposite sign, so that an invocation computes the
// lines of both. The dispatch leaves most of the second lines out; invocations for the others store nothing.
void multiply(int block, int index)
{
    const int RADIX = RADIX_1;
    ivec4 rows = ivec4(params.row_a, params.row_b, params.row_c, params.row_d);
    // The numbers of the blocks before this last stage have reversed digits, too.
    ivec4 blocks = ivec4(params.block_a, params.block_b, params.block_c, 1);
    int run = params.row_last / 2 + 1;
    int across = index + quotient(index, run) * (params.row_last - run);
    int other_across = mirrored(across, rows, params.row_length);
    int other_block = mirrored(block, blocks, params.count);
    int frequency = frequency_at(across, rows), other = frequency == 0 ? 0 : params.row_length - frequency;
    bool own = block == 0;
    // The conjugate spectrum of a real channel is that at the opposite frequency.
    bool conjugates = params.kernel_sign < 0.0;
    vec4 values[FFT_MAX_RADIX], others[FFT_MAX_RADIX], here[FFT_MAX_RADIX], there[FFT_MAX_RADIX];

    idle = idle || frequency > other || (frequency == other && block > other_block);
    // Before the transforms: between them CPUs wait for memory, and the pass takes 1.6 times as long.
    int first = block * RADIX, first_other = other_block * RADIX + (own ? RADIX : RADIX - 1);
    [[unroll]] for (int i = 0; i < RADIX; ++i) {
        here[i] = imageLoad(factor, texel_at(first + i, across));
        // In the block of frequency 0, the opposite frequency is in the same block.
        there[i] = imageLoad(factor, texel_at(own && i == 0 ? 0 : first_other - i, other_across));
    }
    load_line(block, across);
    transform_held(RADIX, false);
    [[unroll]] for (int i = 0; i < RADIX; ++i)
        values[i] = held[place_of(i, RADIX)];
    load_line(other_block, other_across);
    transform_held(RADIX, false);
    [[unroll]] for (int i = 0; i < RADIX; ++i) {
        int j = RADIX - 1 - i, own_j = (RADIX - i) % RADIX;
        vec4 mirror = own ? held[place_of(own_j, RADIX)] : held[place_of(j, RADIX)];
        vec4 kernel = conjugates ? there[i] : here[i], kernel_mirror = conjugates ? here[i] : there[i];
        others[i] = channels(mirror, values[i], kernel_mirror, kernel);
        values[i] = channels(values[i], mirror, kernel, kernel_mirror);
    }
    [[unroll]] for (int i = 0; i < RADIX; ++i)
        held[i] = values[i];
    transform_held(RADIX, true);
    store_line(block, across);
    [[unroll]] for (int i = 0; i < RADIX; ++i)
        held[i] = own ? others[(RADIX - i) % RADIX] : others[RADIX - 1 - i];
    transform_held(RADIX, true);
    store_line(other_block, other_across);
}

void main()
{
    ivec2 id = ivec2(gl_GlobalInvocationID.xy);
    int number = IS_ROW ? id.x : id.y, across = IS_ROW ? id.y : id.x;
    idle = across >= params.across || number >= params.count;
    across = min(across, params.across - 1);
    number = min(number, params.count - 1);
    if (STAGE == STAGE_PRODUCT) {
        multiply(number, across);
        return;
    }
    load_line(number, across);
    if (INVERSE == 0)
        transform_forth(number);
    if (STAGE == STAGE_GREY)
        multiply_each(number, across);
    if (INVERSE != 0 || STAGE == STAGE_GREY)
        transform_back(number);
    if (INVERSE != 0 && (WEIGHTED != 0 || ADDS_IMAGE != 0))
        add_weighted(number, across);
    store_line(number, across);
}
