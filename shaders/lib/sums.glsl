// A pass that adds up values over the pixels of a picture, always in the same order, and their squares, a second
// picture below that of the sums. A pixel of both has those of a block of SUM_SIDE x SUM_SIDE. With DISPATCH a
// workgroup adds up a block, whose neighbouring invocations read neighbouring pixels.
//
// The including shader defines summed_size(), the size of the picture, and add_pixel(), which adds what PIXEL has.
ivec2 summed_size();
void add_pixel(inout vec4 sum, inout vec4 squares);

ivec2 pixel;
#define PIXEL pixel

// Adds up the pixels of a block from `first` on, `apart` pixels from each other.
void add_block(ivec2 block, ivec2 first, int apart, out vec4 sum, out vec4 squares)
{
    ivec2 start = block * SUM_SIDE + first, last = summed_size() - 1;
    sum = squares = vec4(0.0);
    for (int y = start.y; y <= min((block.y + 1) * SUM_SIDE - 1, last.y); y += apart) {
        vec4 row = vec4(0.0), row_squares = vec4(0.0);
        // Without a condition for each pixel, its loads are under way with those of others.
        for (int i = 0; i < SUM_SIDE / apart; ++i) {
            vec4 more = row, more_squares = row_squares;
            int x = start.x + i * apart;
            pixel = ivec2(min(x, last.x), y);
            add_pixel(more, more_squares);
            row = x <= last.x ? more : row;
            row_squares = x <= last.x ? more_squares : row_squares;
        }
        sum += row;
        squares += row_squares;
    }
}

#ifdef DISPATCH

layout(local_size_x = PIXEL_INVOCATIONS, local_size_y = PIXEL_INVOCATIONS) in;
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

shared vec4 sums[PIXEL_INVOCATIONS * PIXEL_INVOCATIONS], sums_of_squares[PIXEL_INVOCATIONS * PIXEL_INVOCATIONS];

void main()
{
    ivec2 block = ivec2(gl_WorkGroupID.xy);
    int own = int(gl_LocalInvocationIndex);
    add_block(block, ivec2(gl_LocalInvocationID.xy), PIXEL_INVOCATIONS, sums[own], sums_of_squares[own]);
    for (int half_of = PIXEL_INVOCATIONS * PIXEL_INVOCATIONS / 2; half_of > 0; half_of /= 2) {
        barrier();
        if (own < half_of) {
            sums[own] += sums[own + half_of];
            sums_of_squares[own] += sums_of_squares[own + half_of];
        }
    }
    if (own == 0) {
        imageStore(target, block, sums[0]);
        imageStore(target, block + ivec2(0, gl_NumWorkGroups.y), sums_of_squares[0]);
    }
}

#else

layout(location = 0) out vec4 colour;

void main()
{
    int blocks = (summed_size().y + SUM_SIDE - 1) / SUM_SIDE;
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 sum, squares;
    add_block(ivec2(at.x, at.y % blocks), ivec2(0), 1, sum, squares);
    colour = at.y < blocks ? sum : squares;
}

#endif
