// Fourier transforms of complete lines: a pass is all stages along an axis, of RADIX_1 to RADIX_4 elements, between which
// shared memory holds the line. Frequencies are in their order.
//
// A spectrum has a complex number in each texel, and the channels beside each other. Of a row of n pixels it has the
// frequencies 0 to n / 2, which tell the rest. So a row of a channel is a line of n / 2 complex numbers: pixels at even
// places are their real parts, those at odd places the imaginary ones. The transform of the row follows from that of
// the line. With two channels as one complex number, and lines of n, the transforms of a convolution of 3840 x 2160
// with a kernel of twice its size take 1.76 ms in place of 1.20 (H200, 2026-11-30).
//
// STAGE_FIRST reads the glow. The rows of a kernel lie as lines where their spectra will be. STAGE_LAST makes pixels, of
// one channel after another. STAGE_PRODUCT transforms columns forth, multiplies them by the kernel's spectrum and
// transforms them back; on the way back the product comes first. STAGE_GREY: the kernel has one channel.

#define ELEMENT vec2
UNIFORM_BLOCK(FFT_BLOCK);
#include "lib/fourier.glsl"
#include "lib/padded.glsl"

layout(local_size_x_id = 34, local_size_y_id = 35) in;
LOADED_IMAGE(SLOT_SPECTRUM, factor, rg32f);
LOADED_IMAGE(SLOT_ADDED_SPECTRUM, added_spectrum, rg32f);
LOADED_IMAGE(SLOT_ADDED, added, rgba32f);
LOADED_IMAGE(SLOT_THROUGH, scene, SOURCE_FORMAT);
LOADED_IMAGE(SLOT_DIFFERENTIATED, differentiated, rgba32f);
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

const bool MULTIPLIES = STAGE == STAGE_PRODUCT || STAGE == STAGE_GREY;

// The line, and how many invocations of the workgroup have the same one.
const int LENGTH = RADIX_1 * RADIX_2 * RADIX_3 * RADIX_4;
const int GROUP_SIZE = IS_ROW ? GROUP_WIDTH : GROUP_HEIGHT;
const int GROUP_LINES = IS_ROW ? GROUP_HEIGHT : GROUP_WIDTH;
// Of a row: the spectra of channels are so many texels apart.
const int FREQUENCIES = LENGTH + 1;
// Unused radices are 1, and the last ones.
const int LAST_RADIX = RADIX_4 > 1   ? RADIX_4
                     : RADIX_3 > 1 ? RADIX_3
                     : RADIX_2 > 1 ? RADIX_2
                                   : RADIX_1;

// One component of each element at a time, since more shared memory would let fewer workgroups run at a time.
shared float exchanged[GROUP_LINES * PITCH + 1];

// The number of the invocation's butterflies in the line, and the line: a row of a channel, or a column.
int number, row, channel, column;
// Whether the invocation stores nothing. None returns, since all of a group reach its barriers.
bool idle;

// Invocations without a butterfly compute, too, but do not store: a branch around many values costs
// more than it saves.
bool has_butterfly(int radix)
{
    return GROUP_SIZE * radix == LENGTH || number < LENGTH / radix;
}

// The place in the line of an element before the first stage, and of a result after the last one.
int place_in_line(int i, int radix)
{
    int place = number + i * (LENGTH / radix);
    return GROUP_SIZE * radix == LENGTH ? place : min(place, LENGTH - 1);
}

// Multiplies element q by exp(-2 pi i k q / n), or its inverse, for k < n / radix.
void rotate(int radix, float k, int n, bool inverse)
{
    vec2 turns[FFT_MAX_RADIX];
    find_turns(radix, k, n, turns);
    [[unroll]] for (int q = 1; q < radix; ++q)
        held[q] = rotated(held[q], inverse ? conjugate(turns[q]) : turns[q]);
}

// Where the line begins in shared memory. Between stages it has padding after each `step` * `radix` elements. The places of
// elements that are multiples of that apart are constants apart.
int start_of_line()
{
    return PITCH * int(IS_ROW ? gl_LocalInvocationID.y : gl_LocalInvocationID.x);
}

// Writes a component of a butterfly's results, `step` apart, to shared memory.
void leave(int component, int radix, int step)
{
    int padding = FFT_PADDING(step, radix, LENGTH);
    int block = quotient(number, step);
    int first = start_of_line() + number + block * (step * (radix - 1) + padding);
    barrier();
    if (has_butterfly(radix)) {
        [[unroll]] for (int i = 0; i < radix; ++i)
            exchanged[first + i * step] = held[place_of(i, radix)][component];
    }
    barrier();
}

// The next stage, whose elements were results of the stage before.
void go_on(int radix, int step, int next, bool inverse)
{
    if (next <= 1)
        return;
    int apart = LENGTH / next, block = step * radix, padding = FFT_PADDING(step, radix, LENGTH);
    int place = GROUP_SIZE == apart ? number : min(number, apart - 1);
    int first = start_of_line() + place + quotient(place, block) * padding;
    [[unroll]] for (int component = 0; component < 2; ++component) {
        leave(component, radix, step);
        [[unroll]] for (int i = 0; i < next; ++i)
            held[i][component] = exchanged[first + i * (apart + apart / block * padding)];
    }
    rotate(next, float(number % block), block * next, inverse);
    transform_held(next, inverse);
}

void transform_forth()
{
    transform_held(RADIX_1, false);
    go_on(RADIX_1, 1, RADIX_2, false);
    go_on(RADIX_2, RADIX_1, RADIX_3, false);
    go_on(RADIX_3, RADIX_1 * RADIX_2, RADIX_4, false);
}

void transform_back()
{
    transform_held(LAST_RADIX, true);
    if (RADIX_4 > 1)
        go_on(RADIX_4, 1, RADIX_3, true);
    if (RADIX_3 > 1)
        go_on(RADIX_3, RADIX_4, RADIX_2, true);
    if (RADIX_2 > 1)
        go_on(RADIX_2, RADIX_4 * RADIX_3, RADIX_1, true);
}

float channel_of(vec4 texel)
{
    return channel == 0 ? texel.r : channel == 1 ? texel.g : channel == 2 ? texel.b : texel.a;
}

// What a convolution spreads of a pixel's channel: as load(), which would make all four finite.
float load_glow(int along)
{
    bool has_texel = true;
    int place = PADDED != 0 ? padded_place(along, has_texel) : along;
    vec4 texel = imageLoad(source, texel_at(place, row));
    if (THROUGH_COMPOSITE != 0)
        texel = params.gain * where_finite(texel, imageLoad(scene, texel_at(place, row)));
    float glow = PREFILTERED != 0 ? channel_of(glow_of(texel)) : kept_of(vec3(channel_of(texel))).x;
    if (WEIGHTED != 0)
        glow *= weight_at(place, row);
    return has_texel ? glow : 0.0;
}

// exp(-2 pi i k / n) of a row of n pixels, for the frequency k of a butterfly's element i, of which that of the first
// element is known.
vec2 turn_of_row(vec2 first, int i, int radix)
{
    return i == 0 ? first : product(first, turn(float(i), 2 * radix));
}

// The spectrum of the line from that of the row.
vec2 load_folded(int frequency, vec2 turned)
{
    int first = channel * FREQUENCIES;
    vec2 here = imageLoad(source, ivec2(first + frequency, row)).xy;
    vec2 mirror = conjugate(imageLoad(source, ivec2(first + LENGTH - frequency, row)).xy);
    vec2 odd = product(here - mirror, conjugate(turned));
    return here + mirror + vec2(-odd.y, odd.x);
}

// Elements from FILLED on are zero.
void load_line(int radix)
{
    vec2 first_turn = turn(float(number), 2 * LENGTH);
    [[unroll]] for (int i = 0; i < radix; ++i) {
        int place = place_in_line(i, radix);
        if (i >= FILLED)
            held[i] = vec2(0.0);
        else if (!IS_ROW)
            held[i] = load(place, column).xy;
        else if (STAGE == STAGE_LAST)
            held[i] = load_folded(place, turn_of_row(first_turn, i, radix));
        else if (STAGE == STAGE_FIRST)
            held[i] = vec2(load_glow(2 * place), load_glow(2 * place + 1));
        else
            held[i] = imageLoad(source, ivec2(channel * FREQUENCIES + place, row)).xy;
    }
}

// Stores the spectrum of the row that follows from that of the line.
void store_unfolded()
{
    vec2 mirrors[FFT_MAX_RADIX];
    [[unroll]] for (int component = 0; component < 2; ++component) {
        leave(component, LAST_RADIX, LENGTH / LAST_RADIX);
        [[unroll]] for (int i = 0; i < LAST_RADIX; ++i) {
            int frequency = place_in_line(i, LAST_RADIX);
            mirrors[i][component] = exchanged[start_of_line() + (frequency == 0 ? 0 : LENGTH - frequency)];
        }
    }
    if (idle || !has_butterfly(LAST_RADIX))
        return;
    int first = channel * FREQUENCIES;
    vec2 first_turn = turn(float(number), 2 * LENGTH);
    [[unroll]] for (int i = 0; i < LAST_RADIX; ++i) {
        int frequency = place_in_line(i, LAST_RADIX);
        vec2 value = held[place_of(i, LAST_RADIX)], mirror = conjugate(mirrors[i]);
        vec2 odd = product(value - mirror, turn_of_row(first_turn, i, LAST_RADIX));
        vec2 spectrum = 0.5 * (value + mirror + vec2(odd.y, -odd.x));
        imageStore(target, ivec2(first + frequency, row), vec4(spectrum, 0.0, 0.0));
        if (i == 0 && frequency == 0)
            imageStore(target, ivec2(first + LENGTH, row), vec4(value.x - value.y, 0.0, 0.0, 0.0));
    }
}

void multiply()
{
    int place = STAGE == STAGE_GREY ? column - params.frequencies * quotient(column, params.frequencies) : column;
    vec2 values[FFT_MAX_RADIX];
    [[unroll]] for (int i = 0; i < LAST_RADIX; ++i) {
        vec2 by = vec2(1.0, params.kernel_sign) * imageLoad(factor, ivec2(place, place_in_line(i, LAST_RADIX))).xy;
        values[i] = product(held[INVERSE != 0 ? i : place_of(i, LAST_RADIX)], by);
    }
    [[unroll]] for (int i = 0; i < LAST_RADIX; ++i)
        held[i] = values[i];
}

void store_column(int radix)
{
    if (idle || !has_butterfly(radix))
        return;
    [[unroll]] for (int i = 0; i < min(radix, KEPT_RESULTS); ++i) {
        int place = place_in_line(i, radix);
        vec2 value = held[place_of(i, radix)];
        if (place >= params.kept)
            continue;
        if (INVERSE != 0 && WEIGHTED != 0)
            value *= weight_at(place - params.before_y, 0);
        if (INVERSE != 0 && ADDS_IMAGE != 0)
            value += imageLoad(added_spectrum, ivec2(column, place)).xy;
        imageStore(target, ivec2(column, place), vec4(value, 0.0, 0.0));
    }
}

void store_pixel(int x, vec4 value)
{
    if (x >= params.kept)
        return;
    if (WEIGHTED != 0)
        value *= weight_at(x - params.before_x, row - params.before_y);
    // It is 0, but compilers do not know that, and have fewer registers left.
    if (CHANNELS == 3)
        value.a = 0.0;
    if (ADDS_IMAGE != 0)
        value += vec4(vec3(params.share), 1.0) * imageLoad(added, ivec2(x, row));
    if (OF_SOURCE != 0)
        value = where_finite(value, imageLoad(differentiated, ivec2(x, row)));
    imageStore(target, ivec2(x, row), stored(value));
}

// The way back of all channels of a row. Of each butterfly's results the first KEPT_RESULTS have pixels that are kept.
void make_pixels()
{
    vec4 even[FFT_MAX_RADIX], odd[FFT_MAX_RADIX];
    [[unroll]] for (int i = 0; i < RADIX_1; ++i)
        even[i] = odd[i] = vec4(0.0);
    [[dont_unroll]] for (channel = CHANNELS - 1; channel >= 0; --channel) {
        load_line(LAST_RADIX);
        transform_back();
        [[unroll]] for (int i = 0; i < KEPT_RESULTS; ++i) {
            even[i] = vec4(held[place_of(i, RADIX_1)].x, even[i].xyz);
            odd[i] = vec4(held[place_of(i, RADIX_1)].y, odd[i].xyz);
        }
    }
    if (idle || !has_butterfly(RADIX_1))
        return;
    [[unroll]] for (int i = 0; i < KEPT_RESULTS; ++i) {
        int x = 2 * place_in_line(i, RADIX_1);
        store_pixel(x, even[i]);
        store_pixel(x + 1, odd[i]);
    }
}

void main()
{
    ivec2 id = ivec2(gl_GlobalInvocationID.xy);
    number = IS_ROW ? id.x : id.y;
    int line = IS_ROW ? id.y : id.x;
    idle = line >= params.across;
    line = min(line, params.across - 1);
    if (IS_ROW && STAGE == STAGE_LAST) {
        row = line;
        make_pixels();
        return;
    }
    column = line;
    // Lines of the same pixels are neighbours.
    row = quotient(line, CHANNELS);
    channel = line - row * CHANNELS;
    load_line(INVERSE != 0 ? LAST_RADIX : RADIX_1);
    if (INVERSE == 0)
        transform_forth();
    if (MULTIPLIES)
        multiply();
    if (INVERSE != 0 || MULTIPLIES)
        transform_back();
    if (IS_ROW)
        store_unfolded();
    else
        store_column(INVERSE != 0 || MULTIPLIES ? RADIX_1 : LAST_RADIX);
}
