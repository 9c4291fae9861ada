// Shared by the variants of a transposed filter: each texel gathers the cotangents of the pixels that read it, with
// the weights from a table (csrc/passes/taps.h). With THROUGH_COMPOSITE these are the cotangents of a composite without
// a curve, from which those of the bloom follow by a factor where the scene is finite. For linear texels, include
// pixels.glsl before this file.
UNIFORM_BLOCK(ADJOINT_FILTER_BLOCK);

// A texel of the image of a slot, and the nearest place in the image of cotangents. (Linear texels repeat the rows
// themselves, and no column is before the first.)
#ifdef LINEAR_TEXELS
#define FETCH(name, slot, texel) load_floats(name, read_shapes[slot], (texel).x, (texel).y)
#define FETCH_MASK(texel) load_float(mask, read_shapes[SLOT_MASK], (texel).x, (texel).y)
#define NEAREST(texel) ivec2(min((texel).x, READ_SIZE(SLOT_COTANGENTS).x - 1), (texel).y)
#else
#define FETCH(name, slot, texel) texelFetch(name, texel, 0)
#define FETCH_MASK(texel) texelFetch(mask, texel, 0).r
#define READ_IMAGE(slot, name) SAMPLED_IMAGE(slot, name)
#define NEAREST(texel) clamp(texel, ivec2(0), textureSize(cotangents, 0) - 1)
#endif

// Copies of parameters (see pixels.glsl).
float gain = params.gain, share = params.share, share_of_mask = params.share_of_mask;

READ_IMAGE(SLOT_COTANGENTS, cotangents);
READ_IMAGE(SLOT_WEIGHTS, table);
READ_IMAGE(SLOT_SCENE, scene);
READ_IMAGE(SLOT_MASK, mask);
READ_IMAGE(SLOT_ADDED, added);
READ_IMAGE(SLOT_DIFFERENTIATED, differentiated);

// The pixels that read a texel, or the weights of a pixel in a kernel for the texels of a block.
vec4 entry(int place)
{
    return FETCH(table, SLOT_WEIGHTS, ivec2(place % TABLE_WIDTH, place / TABLE_WIDTH));
}

vec4 cotangent_at(ivec2 pixel)
{
    vec4 value = FETCH(cotangents, SLOT_COTANGENTS, pixel);
    return THROUGH_COMPOSITE != 0 ? vec4(where_finite(value, FETCH(scene, SLOT_SCENE, pixel)).rgb, 0.0) : value;
}

// The cotangents of this pixel, or of the nearest one in the image.
vec4 texel_at(ivec2 texel)
{
    return cotangent_at(NEAREST(texel));
}

// What other readers of the image have accumulated, or a share of a composite's cotangents. With a mask its scene
// has lost some of its light by that.
vec4 added_at(ivec2 pixel)
{
    if (ADDS_IMAGE == 0)
        return vec4(0.0);
    float own = MASKED != 0 ? share - share_of_mask * FETCH_MASK(pixel) : share;
    return vec4(vec3(own), 1.0) * FETCH(added, SLOT_ADDED, pixel);
}

// The cotangents of a texel. The image of a source has none at NaN and infinity.
vec4 shade(vec4 own, vec4 sum, ivec2 pixel)
{
    sum = gain * sum + own;
    return OF_SOURCE != 0 ? where_finite(sum, FETCH(differentiated, SLOT_DIFFERENTIATED, pixel)) : sum;
}
