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
    ivec2 size = summed_size(), apart = (size + SUM_SIDE - 1) / SUM_SIDE, first = ivec2(gl_FragCoord.xy);
    vec4 sum = vec4(0.0), squares = vec4(0.0);
    for (int y = first.y; y < size.y; y += apart.y) {
        vec4 row = vec4(0.0), row_squares = vec4(0.0);
        for (int x = first.x; x < size.x; x += apart.x) {
            pixel = ivec2(x, y);
            add_pixel(row, row_squares);
        }
        sum += row;
        squares += row_squares;
    }
    all_sum = sum;
    all_squares = squares;
}
