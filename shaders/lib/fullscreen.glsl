// A pass over every pixel of one target, in two variants: a fragment shader or, with DISPATCH, a
// compute shader with one invocation for each pixel. The including shader defines shade(), which
// returns the colour of PIXEL, and TARGET_BINDING, the binding after its images.

//
// With STACKED the target has that number of pictures below each other, each of STACKED_HEIGHT rows. PIXEL
// is a place in each. Then shade() has the picture's number, and start() comes before it.

#ifdef STACKED
void start();
vec4 shade(int number);
#else
vec4 shade();
#endif

#ifdef DISPATCH

layout(local_size_x = PIXEL_INVOCATIONS, local_size_y = PIXEL_INVOCATIONS) in;
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

#define PIXEL ivec2(gl_GlobalInvocationID.xy)

void main()
{
#ifdef STACKED
    if (any(greaterThanEqual(PIXEL, ivec2(imageSize(target).x, STACKED_HEIGHT))))
        return;
    start();
    [[unroll]] for (int i = 0; i < STACKED; ++i)
        imageStore(target, PIXEL + ivec2(0, i * STACKED_HEIGHT), shade(i));
#else
    if (all(lessThan(PIXEL, imageSize(target))))
        imageStore(target, PIXEL, shade());
#endif
}

#else

layout(location = 0) out vec4 colour;

#ifdef STACKED
#define PIXEL ivec2(gl_FragCoord.x, int(gl_FragCoord.y) % STACKED_HEIGHT)

void main()
{
    start();
    colour = shade(int(gl_FragCoord.y) / STACKED_HEIGHT);
}
#else
#define PIXEL ivec2(gl_FragCoord.xy)

void main()
{
    colour = shade();
}
#endif

#endif
