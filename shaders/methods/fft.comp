#version 450
#extension GL_GOOGLE_include_directive : require
// Fourier transforms along one axis of an image, for a convolution. A workgroup transforms
// some lines of the same number of elements. An element is a texel: two complex numbers, which are
// four real channels, red and green in the first one, blue and alpha in the second one.
//
// A line is a row or a column of the image, or a part of it where it is too long for the shared
// memory: of N = A B elements, first B lines of A elements that lie B apart, then A lines of B
// elements that follow each other, with a rotation between them. What comes out stands where it was
// computed: frequency k + A m at B k + m. The way back begins with the lines of B.
//
// The stages of a line are those of Stockham, which leave their results in order: Cochran et al.,
// "What is the Fast Fourier Transform?", Proceedings of the IEEE 55(10), 1967.
#include "lib/block.glsl"
#include "lib/finite.glsl"

UNIFORM_BLOCK(FFT_BLOCK);
#include "lib/storage.glsl"
#include "lib/complex.glsl"

layout(local_size_x = FFT_INVOCATIONS) in;
layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 2) uniform sampler2D factor;
layout(set = 0, binding = 3) uniform writeonly image2D target;

// Of the real and the imaginary part; the second complex number takes the place of the first one.
shared vec2 kept[FFT_ELEMENTS];

// The texels that an invocation has in one stage: most where the radix is 5.
const int HELD = 20;
vec4 held[HELD], moved[HELD];

int line_of_workgroup()
{
    return int(params.horizontal != 0 ? gl_WorkGroupID.x : gl_WorkGroupID.y);
}

int across_of_workgroup()
{
    return int(params.horizontal != 0 ? gl_WorkGroupID.y : gl_WorkGroupID.x);
}

// The number of a line along the axis, and its place across.
int part_of(int line)
{
    return line_of_workgroup() * (params.parts_together != 0 ? params.lines : 1) + (params.parts_together != 0 ? line : 0);
}

int across_of(int line)
{
    return across_of_workgroup() * (params.parts_together != 0 ? 1 : params.lines) + (params.parts_together != 0 ? 0 : line);
}

int place_of(int line, int element)
{
    return part_of(line) * params.part_step + element * params.element_step;
}

ivec2 texel_at(int along, int across)
{
    return params.horizontal != 0 ? ivec2(along, across) : ivec2(across, along);
}

// Where of the `extent` texels the extended line takes its place from; -1: from nowhere.
int inside(int place)
{
    if (place < params.extent)
        return place;
    bool behind = place < params.turn;
    if (params.boundary == BOUNDARY_EDGE)
        return behind ? params.extent - 1 : 0;
    if (params.boundary == BOUNDARY_WRAP)
        return behind ? place - params.extent : place - params.padded + params.extent;
    return -1;
}

vec4 load_glow(int along, int across)
{
    int place = inside(along);
    if (place < 0)
        return vec4(0.0);
    vec4 texel = texelFetch(source, texel_at(place, across), 0);
    if (params.reads == FFT_LOAD_SPECTRUM)
        return texel;
    vec3 colour = clamp(finite_or_zero(texel.rgb), -FFT_LIMIT, FFT_LIMIT);
    if (params.prefilter_max >= params.prefilter_min) {
        float luminance = dot(colour, vec3(0.2126, 0.7152, 0.0722));
        float wanted = min(params.prefilter_factor * (luminance - params.prefilter_min)
                               + params.prefilter_min,
                           params.prefilter_max);
        if (luminance > params.prefilter_min)
            colour *= wanted / luminance;
    }
    float alpha = ALPHA == ALPHA_BLUR ? finite_or_zero(texel.aaa).r : 0.0;
    return vec4(colour, clamp(alpha, -FFT_LIMIT, FFT_LIMIT));
}

// The kernel's values whose light comes from the same place: beyond an edge all of them, and those a
// whole period apart.
vec4 load_kernel(int along, int across)
{
    int offset = along <= params.reach_after ? along : along - params.padded;
    if (offset < -params.reach_before)
        return vec4(0.0);
    int first = params.centre + offset, last = first, step = 1;
    if (params.boundary == BOUNDARY_EDGE) {
        first = offset == -params.reach_before ? 0 : first;
        last = offset == params.reach_after ? params.extent - 1 : last;
    } else if (params.boundary == BOUNDARY_WRAP) {
        first = ((first % params.period) + params.period) % params.period;
        last = params.extent - 1;
        step = params.period;
    }
    vec4 sum = vec4(0.0);
    for (int place = first; place <= last; place += step)
        sum += texelFetch(source, texel_at(place, across), 0);
    sum *= params.gain;
    // One spectrum serves all channels.
    return params.grey != 0 && params.horizontal != 0 ? vec4(sum.r, 0.0, sum.r, 0.0) : sum;
}

// The place of the frequency of the other sign.
int mirrored(int place, int long_part, int short_part)
{
    int frequency = place / short_part + long_part * (place % short_part);
    int other = frequency == 0 ? 0 : long_part * short_part - frequency;
    return short_part * (other % long_part) + other / long_part;
}

// Of two real channels, in one complex number: their product with two real kernels.
vec2 channels(vec2 value, vec2 mirror, vec2 kernel, vec2 kernel_mirror)
{
    vec2 a = conjugate(mirror), b = conjugate(kernel_mirror);
    vec2 first = product(0.5 * (value + a), 0.5 * (kernel + b));
    // Both are i times the second channel's: i x i y = i (i x y).
    vec2 second = product(0.5 * (value - a), 0.5 * (kernel - b));
    return first + vec2(second.y, -second.x);
}

vec4 load_product(int along, int across)
{
    ivec2 at = texel_at(along, across);
    vec4 value = texelFetch(source, at, 0), kernel = texelFetch(factor, at, 0);
    if (params.grey != 0)
        return vec4(product(value.xy, kernel.xy), product(value.zw, kernel.xy));
    ivec2 other = ivec2(mirrored(at.x, params.long_x, params.short_x),
                        mirrored(at.y, params.long_y, params.short_y));
    vec4 mirror = texelFetch(source, other, 0), kernel_mirror = texelFetch(factor, other, 0);
    return vec4(channels(value.xy, mirror.xy, kernel.xy, kernel_mirror.xy),
                channels(value.zw, mirror.zw, kernel.zw, kernel_mirror.zw));
}

vec4 load(int line, int element)
{
    int along = place_of(line, element), across = across_of(line);
    if (params.reads == FFT_LOAD_PART)
        return texelFetch(source, texel_at(along, across), 0);
    if (params.reads == FFT_LOAD_KERNEL)
        return load_kernel(along, across);
    if (params.reads == FFT_LOAD_PRODUCT)
        return load_product(along, across);
    return load_glow(along, across);
}

void store(int line, int element, vec4 value)
{
    ivec2 texel = texel_at(place_of(line, element), across_of(line));
    if (any(greaterThanEqual(texel, imageSize(target))))
        return;
    if (params.rotates != 0) {
        vec2 angle = turn(part_of(line) * element, params.padded);
        value = rotated(value, params.inverse != 0 ? conjugate(angle) : angle);
    }
    if (params.stores != 0)
        value = stored(value);
    imageStore(target, texel, value);
}

// Lines that are neighbours in the image are shared out among neighbouring invocations, columns
// too.
bool lines_first()
{
    return params.horizontal == 0 || params.element_step > 1;
}

// The butterfly of a number, of `count` in each line.
void locate(int number, int count, out int line, out int butterfly)
{
    line = lines_first() ? number % params.lines : number / count;
    butterfly = lines_first() ? number / params.lines : number % count;
}

int slot(int line, int element)
{
    return lines_first() ? element * params.lines + line : line * params.elements + element;
}

// Where a butterfly's results go: those of a run of `before` transforms become one of them.
int target_of(int butterfly, int radix, int before, int i)
{
    return (butterfly / before) * before * radix + butterfly % before + i * before;
}

void load_stage(int radix)
{
    int count = params.elements / radix;
    for (int i = 0; i < HELD / radix; ++i) {
        int number = i * FFT_INVOCATIONS + int(gl_LocalInvocationID.x), line, butterfly;
        if (number >= count * params.lines)
            break;
        locate(number, count, line, butterfly);
        for (int j = 0; j < radix; ++j)
            held[i * radix + j] = load(line, butterfly + j * count);
    }
}

void store_stage(int radix, int before)
{
    int count = params.elements / radix;
    for (int i = 0; i < HELD / radix; ++i) {
        int number = i * FFT_INVOCATIONS + int(gl_LocalInvocationID.x), line, butterfly;
        if (number >= count * params.lines)
            break;
        locate(number, count, line, butterfly);
        for (int j = 0; j < radix; ++j)
            store(line, target_of(butterfly, radix, before, j), held[i * radix + j]);
    }
}

void keep(int radix, int before, bool second)
{
    int count = params.elements / radix;
    for (int i = 0; i < HELD / radix; ++i) {
        int number = i * FFT_INVOCATIONS + int(gl_LocalInvocationID.x), line, butterfly;
        if (number >= count * params.lines)
            break;
        locate(number, count, line, butterfly);
        for (int j = 0; j < radix; ++j) {
            vec4 value = held[i * radix + j];
            kept[slot(line, target_of(butterfly, radix, before, j))] = second ? value.zw : value.xy;
        }
    }
}

void take(int radix, bool second)
{
    int count = params.elements / radix;
    for (int i = 0; i < HELD / radix; ++i) {
        int number = i * FFT_INVOCATIONS + int(gl_LocalInvocationID.x), line, butterfly;
        if (number >= count * params.lines)
            break;
        locate(number, count, line, butterfly);
        for (int j = 0; j < radix; ++j) {
            vec2 value = kept[slot(line, butterfly + j * count)];
            if (second)
                moved[i * radix + j].zw = value;
            else
                moved[i * radix + j].xy = value;
        }
    }
}

// From a stage to the next one, through the shared memory, one complex number after the other.
void exchange(int radix, int before, int next)
{
    for (int part = 0; part < 2; ++part) {
        barrier();
        keep(radix, before, part == 1);
        barrier();
        take(next, part == 1);
    }
    for (int i = 0; i < HELD; ++i)
        held[i] = moved[i];
}

void transform_stage(int radix, int before)
{
    int count = params.elements / radix;
    for (int i = 0; i < HELD / radix; ++i) {
        int number = i * FFT_INVOCATIONS + int(gl_LocalInvocationID.x), line, butterfly;
        if (number >= count * params.lines)
            break;
        locate(number, count, line, butterfly);
        vec4 values[5];
        for (int j = 0; j < radix; ++j)
            values[j] = held[i * radix + j];
        vec2 angle = turn(butterfly % before, before * radix);
        angle = params.inverse != 0 ? conjugate(angle) : angle;
        vec2 power = angle;
        for (int j = 1; j < radix; ++j) {
            if (before > 1)
                values[j] = rotated(values[j], power);
            power = product(power, angle);
        }
        if (radix == 2)
            transform_2(values);
        else if (radix == 3)
            transform_3(values, params.inverse != 0);
        else if (radix == 4)
            transform_4(values, params.inverse != 0);
        else if (radix == 5)
            transform_5(values, params.inverse != 0);
        for (int j = 0; j < radix; ++j)
            held[i * radix + j] = values[j];
    }
}

// The radix of a stage, of hexadecimal digits. A line of one element has a stage of 1.
int radix_of(int stage)
{
    return params.radices >> (4 * stage) & 15;
}

// The number of stages is a parameter also so that compilers do not unroll them.
void main()
{
    int before = 1;
    load_stage(radix_of(0));
    for (int stage = 0; stage < params.stages; ++stage) {
        int radix = radix_of(stage);
        transform_stage(radix, before);
        if (stage + 1 < params.stages)
            exchange(radix, before, radix_of(stage + 1));
        else
            store_stage(radix, before);
        before *= radix;
    }
}
