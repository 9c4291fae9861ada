// The texels of an image's first row, as shaders read them.

layout(local_size_x = 64) in;

layout(binding = 0) uniform sampler2D from_image;
layout(std430, binding = 1) writeonly buffer To
{
    vec4 texels[];
};

void main()
{
    texels[gl_LocalInvocationID.x] = texelFetch(from_image, ivec2(gl_LocalInvocationID.x, 0), 0);
}
