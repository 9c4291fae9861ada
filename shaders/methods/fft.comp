// A Fourier transform along one axis. A texel is two complex numbers: red and green, blue and alpha.
//
// A pass is one stage: a butterfly of RADIX_1 elements, `step` apart, for each invocation. The way forth
// decimates in frequency: results stay where their elements were, so that frequencies end with their
// digits reversed. The way back does the stages the other way round, and needs no reordering.
//
// With COMPLETE lines a pass is all stages, of RADIX_1 to RADIX_4 elements, between which shared memory
// holds the line. Frequencies are in their order. A line of pixels holds four real channels as two complex
// numbers: i times green is added to red, i times alpha to blue. Its transform is stored as those of the
// channels, of which the half with frequencies 0 to n / 2 tells the rest: first of red and green, then of
// blue and alpha. So a product needs no other frequency. On an H200 a convolution is 1.5 (3840 x 2160, a
// kernel of 1024) to 3.0 times as fast as in stages (1920 x 1080, one of 3839 x 2159).
//
// STAGE_FIRST reads the glow, STAGE_LAST stores to an image of the bloom's format. STAGE_PRODUCT is the
// last stage forth along columns, the product with the kernel's spectrum and the first stage back; so is
// STAGE_GREY in stages. On the way back the product comes first.
// PADDED reads what lies beyond the source's edges by the boundary.

UNIFORM_BLOCK(FFT_BLOCK);
#define READ_IMAGE(slot, name) \
    layout(set = 0, binding = BINDING_OF(slot), SOURCE_FORMAT) uniform readonly image2D name
#define READ_FLOATS(slot, name) layout(set = 0, binding = BINDING_OF(slot), rgba32f) uniform readonly image2D name
#include "lib/fourier.glsl"
#include "lib/frequencies.glsl"

layout(local_size_x_id = 34, local_size_y_id = 35) in;
READ_IMAGE(SLOT_SOURCE, source);
READ_FLOATS(SLOT_SPECTRUM, factor);
READ_FLOATS(SLOT_WEIGHTS, weights);
READ_FLOATS(SLOT_ADDED, added);
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

const bool COMPLETE = RADIX_2 > 0;
const bool IS_ROW = DIRECTION == DIRECTION_HORIZONTAL;

ivec2 texel_at(int along, int across)
{
    return IS_ROW ? ivec2(along, across) : ivec2(across, along);
}

vec4 load_source(ivec2 at)
{
    return imageLoad(source, at);
}

vec4 load_factor(ivec2 at)
{
    return imageLoad(factor, at);
}

// The weight of a field's kernel at a pixel.
float weight_at(int along, int across)
{
    ivec2 place = IS_ROW ? ivec2(along, across) : ivec2(0, along);
    vec4 four = imageLoad(weights, clamp(place, ivec2(0), imageSize(weights) - 1));
    return inner_product(four, vec4(equal(ivec4(0, 1, 2, 3), ivec4(params.weight))));
}

void store(ivec2 at, vec4 value)
{
    imageStore(target, at, value);
}

#include "lib/padded.glsl"

// Of complete lines: the length, and how many of the workgroup's invocations have the same line.
const int LENGTH = RADIX_1 * RADIX_2 * RADIX_3 * RADIX_4;
const int GROUP_SIZE = IS_ROW ? GROUP_WIDTH : GROUP_HEIGHT;
const int GROUP_LINES = IS_ROW ? GROUP_HEIGHT : GROUP_WIDTH;
// One float of padding after each 32, so that invocations use different banks of the shared memory.
const int PITCH = LENGTH + (LENGTH >> 5);
// Unused radices are 1, and the last ones.
const int LAST_RADIX = RADIX_4 > 1   ? RADIX_4
                     : RADIX_3 > 1 ? RADIX_3
                     : RADIX_2 > 1 ? RADIX_2
                                   : RADIX_1;

// One component of each element at a time, since more shared memory would let fewer workgroups run at
// a time. Invocations without a butterfly read beyond the line.
shared float exchanged[GROUP_LINES * PITCH + GROUP_SIZE + 1];

int slot(int place)
{
    int line = int(IS_ROW ? gl_LocalInvocationID.y : gl_LocalInvocationID.x);
    return line * PITCH + place + (place >> 5);
}

// Invocations without a butterfly compute, too, but do not store: a branch around many values costs
// more than it saves.
bool has_butterfly(int number, int radix)
{
    return !COMPLETE || GROUP_SIZE * radix == LENGTH || number < LENGTH / radix;
}

// The place of element i of a butterfly whose elements are `step` apart.
int place_at(int number, int i, int radix, int step)
{
    int block = quotient(number, step);
    return number + block * step * (radix - 1) + i * step;
}

// The place in the image: of an element before the pass, and of a result after it.
int place_in_line(int number, int i, int radix)
{
    if (!COMPLETE)
        return place_at(number, i, radix, params.step);
    int place = number + i * (LENGTH / radix);
    return GROUP_SIZE * radix == LENGTH ? place : min(place, LENGTH - 1);
}

// Multiplies element q, or result q, by exp(-2 pi i k q / n), or its inverse, for k < n / radix. Power q of the first
// turn would have q times its error, so that the fourth is computed, too. Their products are within 6e-8, 7e-8 of radix
// 16; powers of one within 1.9e-7.
void rotate(int radix, int k, int n, bool inverse, bool results)
{
    vec2 turns[FFT_MAX_RADIX];
    turns[1] = radix < 8 ? turn(k, n) : small_turn(float(8 * k) * (1.0 / float(n)));
    turns[2] = product(turns[1], turns[1]);
    if (radix > 4) {
        turns[4] = turn(4 * k, n);
        turns[3] = product(turns[4], conjugate(turns[1]));
    } else {
        turns[3] = product(turns[2], turns[1]);
    }
    [[unroll]] for (int q = 5; q < radix; ++q)
        turns[q] = (q & 3) == 0 ? product(turns[q - 4], turns[4]) : product(turns[q & ~3], turns[q & 3]);
    [[unroll]] for (int q = 1; q < radix; ++q) {
        int at = results ? place_of(q, radix) : q;
        held[at] = rotated(held[at], inverse ? conjugate(turns[q]) : turns[q]);
    }
}

// Writes a component of a butterfly's results, `step` apart, to shared memory.
void leave(int component, int number, int radix, int step)
{
    barrier();
    if (has_butterfly(number, radix)) {
        [[unroll]] for (int i = 0; i < radix; ++i)
            exchanged[slot(place_at(number, i, radix, step))] = held[place_of(i, radix)][component];
    }
    barrier();
}

// The next stage of a complete line, whose elements were results of the stage before.
void go_on(int number, int radix, int step, int next, bool inverse)
{
    if (!COMPLETE || next <= 1)
        return;
    [[unroll]] for (int component = 0; component < 4; ++component) {
        leave(component, number, radix, step);
        [[unroll]] for (int i = 0; i < next; ++i)
            held[i][component] = exchanged[slot(number + i * (LENGTH / next))];
    }
    rotate(next, number % (step * radix), step * radix * next, inverse, false);
    transform_held(next, inverse);
}

void transform_forth(int number)
{
    transform_held(RADIX_1, false);
    if (ROTATED != 0)
        rotate(RADIX_1, number % params.step, params.step * RADIX_1, false, true);
    go_on(number, RADIX_1, 1, RADIX_2, false);
    go_on(number, RADIX_2, RADIX_1, RADIX_3, false);
    go_on(number, RADIX_3, RADIX_1 * RADIX_2, RADIX_4, false);
}

void transform_back(int number)
{
    if (ROTATED != 0)
        rotate(RADIX_1, number % params.step, params.step * RADIX_1, true, false);
    transform_held(LAST_RADIX, true);
    if (RADIX_4 > 1)
        go_on(number, RADIX_4, 1, RADIX_3, true);
    if (RADIX_3 > 1)
        go_on(number, RADIX_3, RADIX_4, RADIX_2, true);
    if (RADIX_2 > 1)
        go_on(number, RADIX_2, RADIX_4 * RADIX_3, RADIX_1, true);
}

// Two channels of a pixel from their spectra.
vec2 joined(vec4 spectra, float sign)
{
    return vec2(spectra.x - sign * spectra.w, sign * spectra.y + spectra.z);
}

vec4 load_joined(int frequency, int across)
{
    int known = min(frequency, LENGTH - frequency);
    float sign = known == frequency ? 1.0 : -1.0;
    vec4 first = load_source(ivec2(known, across));
    vec4 second = load_source(ivec2(LENGTH / 2 + 1 + known, across));
    return vec4(joined(first, sign), joined(second, sign));
}

void load_line(int number, int across, int radix)
{
    [[unroll]] for (int i = 0; i < radix; ++i) {
        int along = place_in_line(number, i, radix);
        held[i] = COMPLETE && STAGE == STAGE_LAST ? load_joined(along, across) : load(along, across);
    }
}

// Multiplies a line that came back by weights, and adds another image's.
void add_weighted(int number, int across, int radix)
{
    [[unroll]] for (int i = 0; i < radix; ++i) {
        int along = min(place_in_line(number, i, radix), params.kept - 1), at = place_of(i, radix);
        ivec2 place = texel_at(along, across) - ivec2(params.before_x, params.before_y);
        if (WEIGHTED != 0)
            held[at] *= IS_ROW ? weight_at(place.x, place.y) : weight_at(place.y, 0);
        if (ADDS_IMAGE != 0)
            held[at] += imageLoad(added, texel_at(along, across));
    }
}

// Whether the invocation stores nothing. None returns: of complete lines, all of a group reach its barriers, and
// after a return Mesa 22.3 loads parameters lane by lane.
bool idle;

void store_line(int number, int across, int radix)
{
    if (idle || !has_butterfly(number, radix))
        return;
    [[unroll]] for (int i = 0; i < radix; ++i) {
        int along = place_in_line(number, i, radix);
        vec4 value = held[place_of(i, radix)];
        if (along < params.kept)
            store(texel_at(along, across), STAGE == STAGE_LAST ? stored(value) : value);
    }
}

// The spectra of two channels from that of the first and i times the second.
vec4 separated(vec2 value, vec2 mirror)
{
    return 0.5 * vec4(value.x + mirror.x, value.y - mirror.y, value.y + mirror.y, mirror.x - value.x);
}

void store_separated(int number, int across)
{
    vec2 mirrors[FFT_MAX_RADIX];
    [[unroll]] for (int pair = 0; pair < 2; ++pair) {
        [[unroll]] for (int part = 0; part < 2; ++part) {
            leave(2 * pair + part, number, LAST_RADIX, LENGTH / LAST_RADIX);
            [[unroll]] for (int i = 0; i < LAST_RADIX; ++i) {
                int frequency = place_in_line(number, i, LAST_RADIX);
                mirrors[i][part] = exchanged[slot(frequency == 0 ? 0 : LENGTH - frequency)];
            }
        }
        [[unroll]] for (int i = 0; i < LAST_RADIX; ++i) {
            int frequency = place_in_line(number, i, LAST_RADIX);
            vec4 value = held[place_of(i, LAST_RADIX)];
            vec4 spectra = separated(pair == 0 ? value.xy : value.zw, mirrors[i]);
            if (!idle && has_butterfly(number, LAST_RADIX) && frequency <= LENGTH / 2)
                store(ivec2(pair * (LENGTH / 2 + 1) + frequency, across), spectra);
        }
    }
}

// A product of both complex numbers at a frequency with a kernel's: of separated channels, or of a grey kernel. Without
// the latter a convolution of 960 x 540 takes 40 ms in place of 30, its first call 1.8 s in place of 1.5, with Mesa 25.0.7
// 4.0 s in place of 3.2 (processor time, lavapipe of Mesa 22.3.6, 2026-11-28).
void multiply_each(int number, int across)
{
    vec4 values[FFT_MAX_RADIX];
    vec4 signs = vec2(1.0, params.kernel_sign).xyxy;
    [[unroll]] for (int i = 0; i < LAST_RADIX; ++i) {
        vec4 value = held[INVERSE != 0 ? i : place_of(i, LAST_RADIX)];
        vec4 by = signs * load_factor(ivec2(across, place_in_line(number, i, LAST_RADIX)));
        values[i] = vec4(product(value.xy, by.xy), product(value.zw, by.zw));
    }
    [[unroll]] for (int i = 0; i < LAST_RADIX; ++i)
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
        here[i] = load_factor(texel_at(first + i, across));
        // In the block of frequency 0, the opposite frequency is in the same block.
        there[i] = load_factor(texel_at(own && i == 0 ? 0 : first_other - i, other_across));
    }
    load_line(block, across, RADIX);
    transform_held(RADIX, false);
    [[unroll]] for (int i = 0; i < RADIX; ++i)
        values[i] = held[place_of(i, RADIX)];
    load_line(other_block, other_across, RADIX);
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
    store_line(block, across, RADIX);
    [[unroll]] for (int i = 0; i < RADIX; ++i)
        held[i] = own ? others[(RADIX - i) % RADIX] : others[RADIX - 1 - i];
    transform_held(RADIX, true);
    store_line(other_block, other_across, RADIX);
}

void main()
{
    const bool MULTIPLIES = STAGE == STAGE_PRODUCT || STAGE == STAGE_GREY, RETURNS = INVERSE != 0 || MULTIPLIES;
    ivec2 id = ivec2(gl_GlobalInvocationID.xy);
    int number = IS_ROW ? id.x : id.y, across = IS_ROW ? id.y : id.x;
    idle = across >= params.across || (!COMPLETE && number >= params.count);
    across = min(across, params.across - 1);
    if (!COMPLETE)
        number = min(number, params.count - 1);
    if (!COMPLETE && STAGE == STAGE_PRODUCT) {
        multiply(number, across);
        return;
    }
    load_line(number, across, INVERSE != 0 ? LAST_RADIX : RADIX_1);
    if (INVERSE == 0)
        transform_forth(number);
    if (MULTIPLIES)
        multiply_each(number, across);
    if (RETURNS)
        transform_back(number);
    if (INVERSE != 0 && (WEIGHTED != 0 || ADDS_IMAGE != 0))
        add_weighted(number, across, RADIX_1);
    if (COMPLETE && IS_ROW && !RETURNS)
        store_separated(number, across);
    else
        store_line(number, across, RETURNS ? RADIX_1 : LAST_RADIX);
}
