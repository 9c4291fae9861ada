// Complex numbers as vec2, and small Fourier transforms of two of them at a time, in vec4.

vec2 conjugate(vec2 value)
{
    return vec2(value.x, -value.y);
}

vec2 product(vec2 a, vec2 b)
{
    return vec2(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x);
}

vec4 rotated(vec4 value, vec2 angle)
{
    return vec4(product(value.xy, angle), product(value.zw, angle));
}

// exp(-2 pi i k / n) for 0 <= k < n: by octants, of which polynomials are exact to the last bits of a
// float. A device's own sine may be good to 11 bits.
vec2 turn(int k, int n)
{
    int octant = 8 * k / n;
    float part = float(8 * k - octant * n) / float(n);
    float x = 0.78539816339744831 * ((octant & 1) == 1 ? 1.0 - part : part), x2 = x * x;
    float sine = x + x * x2 * (-1.0 / 6.0 + x2 * (1.0 / 120.0 + x2 * (-1.0 / 5040.0 + x2 / 362880.0)));
    float cosine =
        1.0 + x2 * (-0.5 + x2 * (1.0 / 24.0 + x2 * (-1.0 / 720.0 + x2 * (1.0 / 40320.0))));
    // Octants 1, 2, 5 and 6 are near the axis of the sine.
    bool swapped = octant == 1 || octant == 2 || octant == 5 || octant == 6;
    float c = swapped ? sine : cosine, s = swapped ? cosine : sine;
    return vec2(octant >= 2 && octant <= 5 ? -c : c, octant >= 4 ? s : -s);
}

// -i times both numbers, or i times them on the way back.
vec4 quarter(vec4 value, bool inverse)
{
    return inverse ? vec4(-value.y, value.x, -value.w, value.z)
                   : vec4(value.y, -value.x, value.w, -value.z);
}

void transform_2(inout vec4 v[5])
{
    vec4 sum = v[0] + v[1];
    v[1] = v[0] - v[1];
    v[0] = sum;
}

void transform_3(inout vec4 v[5], bool inverse)
{
    vec4 sum = v[1] + v[2], turned = 0.86602540378443865 * quarter(v[1] - v[2], inverse);
    vec4 middle = v[0] - 0.5 * sum;
    v[0] += sum;
    v[1] = middle + turned;
    v[2] = middle - turned;
}

void transform_4(inout vec4 v[5], bool inverse)
{
    vec4 a = v[0] + v[2], b = v[0] - v[2];
    vec4 c = v[1] + v[3], d = quarter(v[1] - v[3], inverse);
    v[0] = a + c;
    v[1] = b + d;
    v[2] = a - c;
    v[3] = b - d;
}

void transform_5(inout vec4 v[5], bool inverse)
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
