// The images of an adjoint pass that writes runs of COLUMNS pixels, as linear texels or, on GPUs, as samplers,
// and how it ends (see lib/adjoint.glsl). ADDED and DIFFERENTIATED are the bindings of its last two
// images. FETCH loads a pixel of the image at a binding.
#include "lib/where_finite.glsl"

#ifdef LINEAR_TEXELS
#define READ_FLOATS(number, name) READ_IMAGE(number, name)
#define FETCH(name, number, x, y) load_floats(name, read_shapes[number - 1], x, y)
#else
#define READ_FLOATS(number, name) layout(set = 0, binding = number) uniform sampler2D name
#define FETCH(name, number, x, y) texelFetch(name, ivec2(x, y), 0)
#endif

READ_FLOATS(ADDED, added);
READ_FLOATS(DIFFERENTIATED, differentiated);
#ifdef LINEAR_TEXELS
WRITE_IMAGE(DIFFERENTIATED + 1);
#define STORE_COUNT COLUMNS
#include "variants/store.glsl"
#endif

// The cotangents of a pixel.
vec4 gathered(int x, int y, float share, vec4 found)
{
    if (ADD_OWN != 0)
        found += vec4(vec3(share), 1.0) * FETCH(added, ADDED, x, y);
    return FROM_IMAGE != 0
             ? where_finite(found, FETCH(differentiated, DIFFERENTIATED, x, y))
             : found;
}

// Stores the cotangents of a run of pixels.
void store_gathered(int first, int row, float share, vec4 found[COLUMNS])
{
#ifdef LINEAR_TEXELS
    uvec4 raw[COLUMNS];
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        raw[i] = floatBitsToUint(
            gathered(min(first + i, target_shape.x - 1), row, share, found[i]));
    store(first, row, raw);
#else
    int end = imageSize(target).x;
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        if (first + i < end)
            imageStore(target, ivec2(first + i, row), gathered(first + i, row, share, found[i]));
#endif
}
