// Images of a batch: with LAYERS each image has a layer for every picture, and a workgroup works on the
// layer with its number along z. Include this file before any image is declared. Sampled images are read
// by functions: glslang expands a macro again that is in the argument of another one.
#ifdef LAYERS
ivec3 layered(ivec2 at)
{
    return ivec3(at, gl_WorkGroupID.z);
}

vec4 sample_layer(sampler2DArray image, vec2 at)
{
    return texture(image, vec3(at, gl_WorkGroupID.z));
}

vec4 fetch_layer(sampler2DArray image, ivec2 at, int level)
{
    return texelFetch(image, layered(at), level);
}

ivec2 layer_size(sampler2DArray image, int level)
{
    return textureSize(image, level).xy;
}

#define sampler2D sampler2DArray
#define image2D image2DArray
#define texture sample_layer
#define texelFetch fetch_layer
#define textureSize layer_size
#define imageLoad(image, at) imageLoad(image, layered(at))
#define imageStore(image, at, value) imageStore(image, layered(at), value)
#define imageSize(image) imageSize(image).xy
#endif
