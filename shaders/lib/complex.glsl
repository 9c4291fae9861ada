// Complex numbers, alone in a vec2 and two in a vec4, and turns of them.

vec2 conjugate(vec2 value)
{
    return vec2(value.x, -value.y);
}

vec2 product(vec2 a, vec2 b)
{
    return vec2(fma(a.x, b.x, -a.y * b.y), fma(a.x, b.y, a.y * b.x));
}

vec2 rotated(vec2 value, vec2 angle)
{
    return product(value, angle);
}

vec4 rotated(vec4 value, vec2 angle)
{
    return vec4(product(value.xy, angle), product(value.zw, angle));
}

// a / b, rounded down, for 0 <= a < 2^22 and b > 0. CPUs divide integers lane by lane. A sum with 3 * 2^22
// is rounded to the nearest integer, also that of a negative number; half of 1 / b, the least distance to the
// middle of two integers, is above its error. (SwiftShader would add up two constants before.)
int quotient(int a, int b)
{
    return floatBitsToInt(float(2 * a + 1 - b) * (0.5 / float(b)) + 12582912.0) & 0x3fffff;
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

// exp(-2 pi i k / n) for integers 0 <= k < n < 2^18, by quarters: `rounded` is the nearest number of them and 3 * 2^22, as
// in quotient(). What is left of k is exact.
vec2 turn(float k, int n)
{
    const float SHIFT = 12582912.0;
    float rounded = (16.0 * k + 1.0) * (0.25 / float(n)) + SHIFT;
    int quarters = floatBitsToInt(rounded);
    vec2 small = small_turn((8.0 * k - float(2 * n) * (rounded - SHIFT)) * (1.0 / float(n)));
    vec2 turned = (quarters & 1) == 1 ? vec2(small.y, -small.x) : small;
    return (quarters & 2) == 2 ? -turned : turned;
}

// Multiplies by -i, or by i in the inverse transform.
vec2 quarter(vec2 value, bool inverse)
{
    return inverse ? vec2(-value.y, value.x) : vec2(value.y, -value.x);
}

vec4 quarter(vec4 value, bool inverse)
{
    return vec4(quarter(value.xy, inverse), quarter(value.zw, inverse));
}
