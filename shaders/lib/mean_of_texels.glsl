// The mean of count x count texels for a pixel of a target of this height. Blender counts rows from the
// bottom, and repeats the last ones. Include sampling.glsl before this file.
vec4 mean_of_texels(sampler2D source, ivec2 pixel, int height, int count)
{
    ivec2 first = count * ivec2(pixel.x, height - 1 - pixel.y);
    int last = textureSize(source, 0).y - 1;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < count; ++y)
        for (int x = 0; x < count; ++x)
            sum += fetch_clamped(source, ivec2(first.x + x, last - first.y - y));
    return sum / float(count * count);
}
