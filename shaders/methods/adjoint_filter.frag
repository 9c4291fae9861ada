// The transpose of a filter.

#include "lib/fullscreen.glsl"
#include "lib/adjoint_filter.glsl"

// The pixels that read a texel: the first one, their number, and where its weights are.
ivec3 readers(int start, int texel)
{
    ivec4 row = ivec4(entry(start + texel));
    return ivec3(row.xy, row.z + KERNELS * (row.x - row.w));
}

// Of each kernel the weights of rows times those of columns, added up.
vec4 shade()
{
    const bool one_row = DIRECTION == DIRECTION_HORIZONTAL, one_column = DIRECTION == DIRECTION_VERTICAL;
    ivec3 columns = one_column ? ivec3(PIXEL.x, 1, 0) : readers(params.start_x, PIXEL.x);
    ivec3 rows = one_row ? ivec3(PIXEL.y, 1, 0) : readers(params.start_y, PIXEL.y);
    ivec2 number = PIXEL % ADJOINT_SIDE;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < rows.y; ++y) {
        float shares[MAX_KERNELS];
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
            shares[kernel] = one_row ? 1.0 : entry(rows.z + KERNELS * y + kernel)[number.y];
        for (int x = 0; x < columns.y; ++x) {
            float weight = 0.0;
            [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
                weight += shares[kernel]
                        * (one_column ? 1.0 : entry(columns.z + KERNELS * x + kernel)[number.x]);
            sum += weight * cotangent_at(ivec2(columns.x + x, rows.x + y));
        }
    }
    return shade(added_at(PIXEL), sum, PIXEL);
}
