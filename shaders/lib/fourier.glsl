// Discrete Fourier transforms of up to FFT_MAX_RADIX elements in named registers: of `held`, whose elements
// are of the type ELEMENT, one complex number or two. All loops are unrolled, so that no index is known
// only at run time.

#include "lib/complex.glsl"

// Sets turns[q] to exp(-2 pi i k q / n) for q from 1 to before `radix`, for k < n / radix. Power q of the first turn would
// have q times its error, so that the fourth is computed, too. Their products are within 6e-8, 7e-8 of radix 16; powers of
// one within 1.9e-7.
void find_turns(int radix, float k, int n, out vec2 turns[FFT_MAX_RADIX])
{
    turns[1] = radix < 8 ? turn(k, n) : small_turn(8.0 * k * (1.0 / float(n)));
    turns[2] = product(turns[1], turns[1]);
    if (radix > 4) {
        turns[4] = turn(4.0 * k, n);
        turns[3] = product(turns[4], conjugate(turns[1]));
    } else {
        turns[3] = product(turns[2], turns[1]);
    }
    [[unroll]] for (int q = 5; q < radix; ++q)
        turns[q] = (q & 3) == 0 ? product(turns[q - 4], turns[4]) : product(turns[q & ~3], turns[q & 3]);
}

void transform_2(inout ELEMENT a, inout ELEMENT b)
{
    ELEMENT sum = a + b;
    b = a - b;
    a = sum;
}

void transform_3(inout ELEMENT v[8], bool inverse)
{
    ELEMENT sum = v[1] + v[2], turned = 0.86602540378443865 * quarter(v[1] - v[2], inverse);
    ELEMENT middle = v[0] - 0.5 * sum;
    v[0] += sum;
    v[1] = middle + turned;
    v[2] = middle - turned;
}

void transform_4(inout ELEMENT p, inout ELEMENT q, inout ELEMENT r, inout ELEMENT s, bool inverse)
{
    ELEMENT a = p + r, b = p - r;
    ELEMENT c = q + s, d = quarter(q - s, inverse);
    p = a + c;
    q = b + d;
    r = a - c;
    s = b - d;
}

void transform_5(inout ELEMENT v[8], bool inverse)
{
    // Cosines and sines of 2 pi / 5 and 4 pi / 5.
    const float C1 = 0.30901699437494742, C2 = -0.80901699437494742;
    const float S1 = 0.95105651629515357, S2 = 0.58778525229247313;
    ELEMENT a = v[1] + v[4], b = v[2] + v[3];
    ELEMENT c = quarter(v[1] - v[4], inverse), d = quarter(v[2] - v[3], inverse);
    ELEMENT first = v[0] + C1 * a + C2 * b, second = v[0] + C2 * a + C1 * b;
    ELEMENT third = S1 * c + S2 * d, fourth = S2 * c - S1 * d;
    v[0] += a + b;
    v[1] = first + third;
    v[2] = second + fourth;
    v[3] = second - fourth;
    v[4] = first - third;
}

void transform_8(inout ELEMENT v[8], bool inverse)
{
    const float HALF_ROOT = 0.70710678118654752;
    ELEMENT even[4] = {v[0], v[2], v[4], v[6]}, odd[4] = {v[1], v[3], v[5], v[7]};
    transform_4(even[0], even[1], even[2], even[3], inverse);
    transform_4(odd[0], odd[1], odd[2], odd[3], inverse);
    ELEMENT turned = quarter(odd[1], inverse), last = quarter(odd[3], inverse);
    odd[1] = HALF_ROOT * (odd[1] + turned);
    odd[2] = quarter(odd[2], inverse);
    odd[3] = HALF_ROOT * (last - odd[3]);
    [[unroll]] for (int i = 0; i < 4; ++i) {
        v[i] = even[i] + odd[i];
        v[i + 4] = even[i] - odd[i];
    }
}

ELEMENT held[FFT_MAX_RADIX];

// Transforms `count` elements that are `step` apart.
void transform_few(int count, int first, int step, bool inverse)
{
    ELEMENT v[8];
    [[unroll]] for (int i = 0; i < 8; ++i)
        if (i < count)
            v[i] = held[first + i * step];
    if (count == 2)
        transform_2(v[0], v[1]);
    else if (count == 3)
        transform_3(v, inverse);
    else if (count == 4)
        transform_4(v[0], v[1], v[2], v[3], inverse);
    else if (count == 5)
        transform_5(v, inverse);
    else if (count == 8)
        transform_8(v, inverse);
    [[unroll]] for (int i = 0; i < 8; ++i)
        if (i < count)
            held[first + i * step] = v[i];
}

// A radix is the product of two that transform_few has.
int second_factor(int radix)
{
    return radix == 16     ? 4
         : radix % 8 == 0 ? 8
         : radix % 5 == 0 ? 5
         : radix % 4 == 0 ? 4
         : radix % 3 == 0 ? 3
                          : radix;
}

// The transform of the first `radix` elements (a constant) leaves element q at held[place_of(q, radix)].
int place_of(int q, int radix)
{
    int b = second_factor(radix), a = radix / b;
    return b * (q % a) + q / a;
}

void transform_held(int radix, bool inverse)
{
    int b = second_factor(radix), a = radix / b;
    [[unroll]] for (int j = 0; j < b; ++j)
        transform_few(a, j, b, inverse);
    [[unroll]] for (int q = 1; q < a; ++q) {
        [[unroll]] for (int j = 1; j < b; ++j) {
            // All operands are constants, so that the driver computes the angle once.
            vec2 angle = turn(float(q * j), radix);
            held[b * q + j] = rotated(held[b * q + j], inverse ? conjugate(angle) : angle);
        }
    }
    [[unroll]] for (int q = 0; q < a; ++q)
        transform_few(b, b * q, 1, inverse);
}
