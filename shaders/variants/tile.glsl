// A symmetric kernel along columns and rows, for GPUs. A workgroup writes a tile, and keeps its vertical sums in
// shared memory between the two. The including shader includes fused_bloom.glsl, declares `image`, of the size of
// the target, and `target`, and defines the functions below.

const int RUN = TILE_ROWS / TILE_RUNS;

layout(local_size_x = TILE_LOADED, local_size_y = TILE_RUNS) in;

// Defined by the including shader: the value of a pixel, which may be outside of the image; what a run of vertical
// sums and a horizontal sum lack at the edges; how a vertical sum is kept, and the pixel that is stored.
vec3 value_at(ivec2 place, ivec2 last);
void end_run(ivec2 place, ivec2 last, inout vec3 run[RUN]);
void end_row(int row, int column, bool starts, bool ends, inout vec3 sum);
void keep_sum(int row, int column, vec3 sum);
vec3 kept_sum(int row, int column);
vec4 shade(ivec2 pixel, vec3 sum);

// Computes a run of vertical sums in one column and loads each pixel once.
void sum_vertically(ivec2 place, ivec2 last, int top, int column)
{
    vec3 run[RUN];
    for (int i = 0; i < RUN; ++i)
        run[i] = vec3(0.0);
    for (int at = -RADIUS; at < RUN + RADIUS; ++at) {
        vec3 value = value_at(place + ivec2(0, at), last);
        for (int i = 0; i < RUN; ++i)
            if (abs(at - i) <= RADIUS)
                run[i] += vertical_weight(at - i) * value;
    }
    end_run(place, last, run);
    for (int i = 0; i < RUN; ++i)
        keep_sum(top + i, column, run[i]);
}

vec3 sum_horizontally(int row, int column)
{
    vec3 sum = vec3(0.0);
    for (int tap = -RADIUS; tap <= RADIUS; ++tap)
        sum += horizontal_weight(tap) * kept_sum(row, column + RADIUS + tap);
    return sum;
}

void main()
{
    const int columns = TILE_LOADED - 2 * RADIUS;
    ivec2 last = textureSize(image, 0) - 1;
    ivec2 first = ivec2(gl_WorkGroupID.xy) * ivec2(columns, TILE_ROWS);
    int column = int(gl_LocalInvocationID.x), top = int(gl_LocalInvocationID.y) * RUN;

    sum_vertically(first + ivec2(column - RADIUS, top), last, top, column);
    barrier();
    if (column >= columns || first.x + column > last.x)
        return;
    for (int i = 0; i < RUN; ++i) {
        // Consecutive invocations take consecutive rows, so that the accesses of a warp are
        // adjacent in memory.
        int row = i * TILE_RUNS + int(gl_LocalInvocationID.y);
        ivec2 pixel = first + ivec2(column, row);
        if (pixel.y > last.y)
            continue;
        vec3 sum = sum_horizontally(row, column);
        end_row(row, column, pixel.x == 0, pixel.x == last.x, sum);
        imageStore(target, pixel, shade(pixel, sum));
    }
}
