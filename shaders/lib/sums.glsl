// A pass that adds up values and squares over the pixels of a picture, always in the same order, for two
// targets: each of their pixels has those at distances of the targets' size, SUM_SIDE x SUM_SIDE at most. So
// neighbouring invocations read neighbouring pixels. The including shader defines summed_size(), the size
// of the picture, and add_pixel(), which adds what PIXEL has.
ivec2 summed_size();
void add_pixel(inout vec4 sum, inout vec4 squares);

layout(location = 0) out vec4 all_sum;
layout(location = 1) out vec4 all_squares;

ivec2 pixel;
#define PIXEL pixel

void main()
{
    ivec2 size = summed_size(), distance = (size + SUM_SIDE - 1) / SUM_SIDE, first = ivec2(gl_FragCoord.xy);
    all_sum = all_squares = vec4(0.0);
    for (pixel.y = first.y; pixel.y < size.y; pixel.y += distance.y) {
        vec4 sum = vec4(0.0), squares = vec4(0.0);
        for (pixel.x = first.x; pixel.x < size.x; pixel.x += distance.x)
            add_pixel(sum, squares);
        all_sum += sum;
        all_squares += squares;
    }
}
