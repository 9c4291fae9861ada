// An image times a weight of each pixel (weigh.frag), into an image of single floats.

UNIFORM_BLOCK(WEIGH_BLOCK);
#include "variants/pixels.glsl"

READ_IMAGE(SLOT_SOURCE, source);
READ_IMAGE(SLOT_WEIGHTS, weights);

layout(local_size_x = ROW_INVOCATIONS) in;
#include "variants/store_float.glsl"

void main()
{
    copy_shapes();
    ivec2 first = first_pixel(ivec2(1, TEXEL_ROWS));
    int end = min(first.y + TEXEL_ROWS, target_shape.y), x = min(first.x, target_shape.x - 1);
    vec4 channel = vec4(equal(ivec4(0, 1, 2, 3), ivec4(params.channel)));

    for (int y = first.y; y < end; ++y) {
        vec4 value = load_pixel(source, read_shapes[SLOT_SOURCE], x, y);
        vec4 weight = load_floats(weights, read_shapes[SLOT_WEIGHTS], x, y);
        store_float(first.x, y, inner_product(weight, channel) * value);
    }
}
