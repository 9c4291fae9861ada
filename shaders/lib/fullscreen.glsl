// A pass over every pixel of one target, in two variants: a fragment shader or, with DISPATCH, a
// compute shader with one invocation for each pixel. The including shader defines shade(), which
// returns the colour of PIXEL, and TARGET_BINDING, the binding after its images.

vec4 shade();

#ifdef DISPATCH

layout(local_size_x = PIXEL_INVOCATIONS, local_size_y = PIXEL_INVOCATIONS) in;
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

#define PIXEL ivec2(gl_GlobalInvocationID.xy)

void main()
{
    if (all(lessThan(PIXEL, imageSize(target))))
        imageStore(target, PIXEL, shade());
}

#else

layout(location = 0) out vec4 colour;

#define PIXEL ivec2(gl_FragCoord.xy)

void main()
{
    colour = shade();
}

#endif
