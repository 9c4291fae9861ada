// A pass over every pixel of one target, in two variants: a fragment shader or, with DISPATCH, a
// compute shader with one invocation for each pixel. The including shader defines shade(), which
// returns the colour of PIXEL.
//
// With STACKED the target has that number of pictures below each other, each of STACKED_HEIGHT rows. PIXEL
// is a place in each, shade() is of `picture`, and start() comes before it.
#ifdef STACKED
void start();
#else
#define STACKED 1
#define STACKED_HEIGHT 1
void start() {}
#endif

vec4 shade();

int picture = 0;

#ifdef DISPATCH

layout(local_size_x = PIXEL_INVOCATIONS, local_size_y = PIXEL_INVOCATIONS) in;
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

#define PIXEL ivec2(gl_GlobalInvocationID.xy)

void main()
{
    if (any(greaterThanEqual(PIXEL, imageSize(target) / ivec2(1, STACKED))))
        return;
    start();
    [[unroll]] for (; picture < STACKED; ++picture)
        imageStore(target, PIXEL + ivec2(0, picture * STACKED_HEIGHT), shade());
}

#else

layout(location = 0) out vec4 colour;

#define PIXEL (ivec2(gl_FragCoord.xy) - ivec2(0, picture * STACKED_HEIGHT))

void main()
{
    if (STACKED > 1)
        picture = int(gl_FragCoord.y) / STACKED_HEIGHT;
    start();
    colour = shade();
}

#endif
