// Upsampling to exactly twice the size. Along each axis a pixel is a weighted sum of four texels; the
// weights (`taps`) alternate between a vector and its reverse. All variants of such a pass sum rows
// first.

vec4 four(vec4 a, vec4 b, vec4 c, vec4 d, bool odd)
{
    vec4 taps = odd ? params.taps[0] : params.taps[0].wzyx;
    return taps.x * a + taps.y * b + taps.z * c + taps.w * d;
}
