// The main of a pass whose pixels need the texels at their own place alone. A shader that includes
// this has the target, and defines shade(pixel) after it.
vec4 shade(ivec2 pixel);

void main()
{
    ivec2 size = imageSize(target);
    ivec2 first = ivec2(gl_GlobalInvocationID.xy) * ivec2(TEXEL_COLUMNS, TEXEL_ROWS);
    int end = min(first.y + TEXEL_ROWS, size.y);

    for (int y = first.y; y < end; ++y)
        for (int i = 0; i < TEXEL_COLUMNS; ++i) {
            ivec2 pixel = ivec2(first.x + i, y);
            if (pixel.x < size.x)
                imageStore(target, pixel, shade(pixel));
        }
}
