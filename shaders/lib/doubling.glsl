// To exactly twice the size: a side, each pixel is a sum of four texels whose weights (`taps`) are
// mirrored from one pixel to the next. All variants of such a pass add the rows up first.

vec3 four(vec3 a, vec3 b, vec3 c, vec3 d, bool odd)
{
    vec4 taps = odd ? params.taps[0] : params.taps[0].wzyx;
    return taps.x * a + taps.y * b + taps.z * c + taps.w * d;
}
