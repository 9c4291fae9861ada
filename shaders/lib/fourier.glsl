// Discrete Fourier transforms of up to FFT_MAX_RADIX elements in named registers: of `held`, whose
// elements are two complex numbers each. All loops are unrolled, so that no index is known only at run
// time.

vec2 conjugate(vec2 value)
{
    return vec2(value.x, -value.y);
}

vec2 product(vec2 a, vec2 b)
{
    return vec2(fma(a.x, b.x, -a.y * b.y), fma(a.x, b.y, a.y * b.x));
}

vec4 rotated(vec4 value, vec2 angle)
{
    return vec4(product(value.xy, angle), product(value.zw, angle));
}

// a / b, rounded down, for 0 <= a < 2^22 and b > 0. CPUs divide integers lane by lane. A sum with 3 * 2^22
// is rounded to the nearest integer, also that of a negative number; half of 1 / b, the least distance to the
// middle of two integers, is above its error.
int quotient(int a, int b)
{
    return floatBitsToInt((float(a) + 0.5) * (1.0 / float(b)) - 0.5 + 12582912.0) & 0x3fffff;
}

// exp(-i pi p / 4) for -1 <= p <= 1, to the last bits of floats: the polynomials are within 2e-9, and pi / 4 is the sum of
// two floats. A device's own sine may be good to 11 bits.
vec2 small_turn(float p)
{
    float p2 = p * p;
    float rest = -2.1855694e-8 + p2 * (-0.0807454347 + p2 * (0.00248998972 - p2 * 3.59390410e-5));
    float less = -0.308425136 + p2 * (0.0158543278 + p2 * (-0.000325942007 + p2 * 3.53133426e-6));
    return vec2(fma(p2, less, 1.0), -fma(p, 0.78539816339744831, p * rest));
}

// exp(-2 pi i k / n) for 0 <= k < n < 2^18, by quarters.
vec2 turn(int k, int n)
{
    int quarters = quotient(8 * k + n, 2 * n);
    vec2 small = small_turn(float(8 * k - 2 * n * quarters) * (1.0 / float(n)));
    vec2 turned = (quarters & 1) == 1 ? vec2(small.y, -small.x) : small;
    return (quarters & 2) == 2 ? -turned : turned;
}

// Multiplies both numbers by -i, or by i in the inverse transform.
vec4 quarter(vec4 value, bool inverse)
{
    return inverse ? vec4(-value.y, value.x, -value.w, value.z)
                   : vec4(value.y, -value.x, value.w, -value.z);
}

void transform_2(inout vec4 a, inout vec4 b)
{
    vec4 sum = a + b;
    b = a - b;
    a = sum;
}

void transform_3(inout vec4 v[8], bool inverse)
{
    vec4 sum = v[1] + v[2], turned = 0.86602540378443865 * quarter(v[1] - v[2], inverse);
    vec4 middle = v[0] - 0.5 * sum;
    v[0] += sum;
    v[1] = middle + turned;
    v[2] = middle - turned;
}

void transform_4(inout vec4 p, inout vec4 q, inout vec4 r, inout vec4 s, bool inverse)
{
    vec4 a = p + r, b = p - r;
    vec4 c = q + s, d = quarter(q - s, inverse);
    p = a + c;
    q = b + d;
    r = a - c;
    s = b - d;
}

void transform_5(inout vec4 v[8], bool inverse)
{
    // Cosines and sines of 2 pi / 5 and 4 pi / 5.
    const float C1 = 0.30901699437494742, C2 = -0.80901699437494742;
    const float S1 = 0.95105651629515357, S2 = 0.58778525229247313;
    vec4 a = v[1] + v[4], b = v[2] + v[3];
    vec4 c = quarter(v[1] - v[4], inverse), d = quarter(v[2] - v[3], inverse);
    vec4 first = v[0] + C1 * a + C2 * b, second = v[0] + C2 * a + C1 * b;
    vec4 third = S1 * c + S2 * d, fourth = S2 * c - S1 * d;
    v[0] += a + b;
    v[1] = first + third;
    v[2] = second + fourth;
    v[3] = second - fourth;
    v[4] = first - third;
}

void transform_8(inout vec4 v[8], bool inverse)
{
    const float HALF_ROOT = 0.70710678118654752;
    vec4 even[4] = {v[0], v[2], v[4], v[6]}, odd[4] = {v[1], v[3], v[5], v[7]};
    transform_4(even[0], even[1], even[2], even[3], inverse);
    transform_4(odd[0], odd[1], odd[2], odd[3], inverse);
    vec4 turned = quarter(odd[1], inverse), last = quarter(odd[3], inverse);
    odd[1] = HALF_ROOT * (odd[1] + turned);
    odd[2] = quarter(odd[2], inverse);
    odd[3] = HALF_ROOT * (last - odd[3]);
    [[unroll]] for (int i = 0; i < 4; ++i) {
        v[i] = even[i] + odd[i];
        v[i + 4] = even[i] - odd[i];
    }
}

vec4 held[FFT_MAX_RADIX];

// Transforms `count` elements that are `step` apart.
void transform_few(int count, int first, int step, bool inverse)
{
    vec4 v[8];
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
            vec2 angle = turn(q * j, radix);
            held[b * q + j] = rotated(held[b * q + j], inverse ? conjugate(angle) : angle);
        }
    }
    [[unroll]] for (int q = 0; q < a; ++q)
        transform_few(b, b * q, 1, inverse);
}
