// A Fourier transform of complete lines, in shared memory: each workgroup has GROUP_WIDTH lines, and
// each of its invocations the elements of one butterfly. Frequencies end in their natural order.
//
// A line of pixels holds four real channels as two complex numbers: i times green is added to red, i
// times alpha to blue. Its transform is stored as those of the channels, of which the half with
// frequencies 0 to n / 2 tells the rest: first of red and green, then of blue and alpha. So a product
// with the spectrum of a kernel needs no other frequency.
//
// STAGE is FIRST (rows of the glow) or PLAIN (the kernel), GREY or COLOURS (columns of the glow forth,
// times the kernel's spectrum, and back), or LAST (rows back, to an image of the bloom's format).
// PADDED reads what lies beyond the source's edges by the boundary.

UNIFORM_BLOCK(FFT_BLOCK);
#define FFT_HELD FFT_MAX_GROUP_RADIX
#include "lib/fourier.glsl"

layout(local_size_x_id = 34, local_size_y_id = 35) in;
layout(set = 0, binding = 1, SOURCE_FORMAT) uniform readonly image2D source;
layout(set = 0, binding = 2, SOURCE_FORMAT) uniform readonly image2D factor;
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

const int LENGTH = RADIX_1 * RADIX_2 * RADIX_3 * RADIX_4;
// One float of padding after each 32, so that invocations use different banks of the shared memory.
const int PITCH = LENGTH + (LENGTH >> 5);
const bool IS_ROW = DIRECTION == DIRECTION_HORIZONTAL;
const bool MULTIPLIES = STAGE == STAGE_GREY || STAGE == STAGE_COLOURS;

// One component of each element at a time, since more shared memory would let fewer workgroups run at
// a time. Invocations without a butterfly read beyond the line.
shared float exchanged[GROUP_WIDTH * PITCH + GROUP_HEIGHT + 1];

// A radix is the product of two that transform_held has.
int first_factor(int radix)
{
    return radix == 16 || radix == 12 ? 4
         : radix == 15 || radix == 9  ? 3
         : radix == 10 || radix == 6  ? 2
                                      : radix;
}

int place_of(int q, int radix)
{
    return place_of(q, first_factor(radix), radix / first_factor(radix));
}

ivec2 texel_at(int along, int across)
{
    return IS_ROW ? ivec2(along, across) : ivec2(across, along);
}

vec4 load_source(ivec2 at)
{
    return imageLoad(source, at);
}

#include "lib/padded.glsl"

// The number of the line, and of this invocation's butterfly.
int across, number;

int slot(int place)
{
    return int(gl_LocalInvocationID.x) * PITCH + place + (place >> 5);
}

// Invocations without a butterfly compute, too, but do not store: a branch around many values costs
// more than it saves.
bool has_butterfly(int radix)
{
    return GROUP_HEIGHT * radix == LENGTH || number < LENGTH / radix;
}

// The place of element i before a butterfly, and of result i after the last one.
int place_at(int i, int radix)
{
    int place = number + i * (LENGTH / radix);
    return GROUP_HEIGHT * radix == LENGTH ? place : min(place, LENGTH - 1);
}

// Results of a butterfly are `before` elements apart.
int first_result(int radix, int before)
{
    return number / before * before * radix + number % before;
}

// Writes a component of the last butterfly's results to shared memory.
void leave(int component, int radix, int before)
{
    int first = first_result(radix, before);
    barrier();
    if (has_butterfly(radix)) {
        [[unroll]] for (int i = 0; i < radix; ++i)
            exchanged[slot(first + i * before)] = held[place_of(i, radix)][component];
    }
    barrier();
}

// Replaces the results of a butterfly by the elements of the next one.
void exchange(int radix, int before, int next)
{
    [[unroll]] for (int component = 0; component < 4; ++component) {
        leave(component, radix, before);
        [[unroll]] for (int i = 0; i < next; ++i)
            held[i][component] = exchanged[slot(number + i * (LENGTH / next))];
    }
}

// Multiplies element q by exp(-2 pi i k q / n), or its inverse; k depends on the invocation.
void rotate(int radix, int before, bool inverse)
{
    vec2 one = turn(number % before, before * radix);
    one = inverse ? conjugate(one) : one;
    vec2 two = product(one, one), three = product(one, two), four = product(two, two);
    vec2 base = vec2(1.0, 0.0);
    [[unroll]] for (int q = 0; q < radix; q += 4) {
        held[q] = q > 0 ? rotated(held[q], base) : held[q];
        if (q + 1 < radix)
            held[q + 1] = rotated(held[q + 1], q > 0 ? product(base, one) : one);
        if (q + 2 < radix)
            held[q + 2] = rotated(held[q + 2], q > 0 ? product(base, two) : two);
        if (q + 3 < radix)
            held[q + 3] = rotated(held[q + 3], q > 0 ? product(base, three) : three);
        base = q > 0 ? product(base, four) : four;
    }
}

void transform(int radix, int before, bool inverse)
{
    if (before > 1)
        rotate(radix, before, inverse);
    transform_held(first_factor(radix), radix / first_factor(radix), inverse);
}

void go_on(int radix, int before, int next, bool inverse)
{
    if (next == 1)
        return;
    exchange(radix, before, next);
    transform(next, before * radix, inverse);
}

// Radices of 1 come last in the forward transform and first in the inverse.
const int LAST_RADIX = RADIX_4 > 1   ? RADIX_4
                     : RADIX_3 > 1 ? RADIX_3
                     : RADIX_2 > 1 ? RADIX_2
                                   : RADIX_1;

void transform_forth()
{
    transform(RADIX_1, 1, false);
    go_on(RADIX_1, 1, RADIX_2, false);
    go_on(RADIX_2, RADIX_1, RADIX_3, false);
    go_on(RADIX_3, RADIX_1 * RADIX_2, RADIX_4, false);
}

void transform_back()
{
    transform(LAST_RADIX, 1, true);
    if (RADIX_4 > 1)
        go_on(RADIX_4, 1, RADIX_3, true);
    if (RADIX_3 > 1)
        go_on(RADIX_3, RADIX_4, RADIX_2, true);
    if (RADIX_2 > 1)
        go_on(RADIX_2, RADIX_4 * RADIX_3, RADIX_1, true);
}

// The columns of an image of spectra that have the same channels.
int half_columns(int row_length)
{
    return row_length / 2 + 1;
}

// Two channels of a pixel from their spectra.
vec2 joined(vec4 spectra, float sign)
{
    return vec2(spectra.x - sign * spectra.w, sign * spectra.y + spectra.z);
}

vec4 load_joined(int frequency, int line)
{
    int known = min(frequency, LENGTH - frequency);
    float sign = known == frequency ? 1.0 : -1.0;
    vec4 first = imageLoad(source, ivec2(known, line));
    vec4 second = imageLoad(source, ivec2(half_columns(LENGTH) + known, line));
    return vec4(joined(first, sign), joined(second, sign));
}

void load_line(int radix)
{
    int line = min(across, params.across - 1);
    [[unroll]] for (int i = 0; i < radix; ++i) {
        int along = place_at(i, radix);
        held[i] = STAGE == STAGE_LAST ? load_joined(along, line) : load(along, line);
    }
}

void store_line(int radix)
{
    if (!has_butterfly(radix) || across >= params.across)
        return;
    [[unroll]] for (int i = 0; i < radix; ++i) {
        int along = place_at(i, radix);
        vec4 value = held[place_of(i, radix)];
        if (along < params.kept)
            imageStore(target, texel_at(along, across), STAGE == STAGE_LAST ? stored(value) : value);
    }
}

// The spectra of two channels from that of the first and i times the second.
vec4 separated(vec2 value, vec2 mirror)
{
    return 0.5 * vec4(value.x + mirror.x, value.y - mirror.y, value.y + mirror.y, mirror.x - value.x);
}

void store_separated(int radix)
{
    vec2 mirrors[FFT_MAX_GROUP_RADIX];
    [[unroll]] for (int pair = 0; pair < 2; ++pair) {
        [[unroll]] for (int part = 0; part < 2; ++part) {
            leave(2 * pair + part, radix, LENGTH / radix);
            [[unroll]] for (int i = 0; i < radix; ++i) {
                int frequency = place_at(i, radix);
                mirrors[i][part] = exchanged[slot(frequency == 0 ? 0 : LENGTH - frequency)];
            }
        }
        [[unroll]] for (int i = 0; i < radix; ++i) {
            int frequency = place_at(i, radix);
            vec4 value = held[place_of(i, radix)];
            vec4 spectra = separated(pair == 0 ? value.xy : value.zw, mirrors[i]);
            if (has_butterfly(radix) && across < params.across && frequency <= LENGTH / 2)
                imageStore(target, ivec2(pair * half_columns(LENGTH) + frequency, across), spectra);
        }
    }
}

void multiply(int radix)
{
    // Of a grey kernel all channels have one spectrum, which is read once.
    int columns = half_columns(params.row_length);
    int line = min(across, params.across - 1);
    int column = STAGE == STAGE_GREY && line >= columns ? line - columns : line;
    vec4 values[FFT_MAX_GROUP_RADIX];
    [[unroll]] for (int i = 0; i < radix; ++i) {
        vec4 value = held[place_of(i, radix)];
        vec4 by = imageLoad(factor, ivec2(column, place_at(i, radix)));
        values[i] = vec4(product(value.xy, by.xy), product(value.zw, by.zw));
    }
    [[unroll]] for (int i = 0; i < radix; ++i)
        held[i] = values[i];
}

void main()
{
    across = int(gl_WorkGroupID.x) * GROUP_WIDTH + int(gl_LocalInvocationID.x);
    number = int(gl_LocalInvocationID.y);
    load_line(INVERSE != 0 ? LAST_RADIX : RADIX_1);
    if (INVERSE == 0)
        transform_forth();
    if (MULTIPLIES)
        multiply(LAST_RADIX);
    if (INVERSE != 0 || MULTIPLIES)
        transform_back();
    if (INVERSE != 0 || MULTIPLIES)
        store_line(RADIX_1);
    else if (IS_ROW)
        store_separated(LAST_RADIX);
    else
        store_line(LAST_RADIX);
}
