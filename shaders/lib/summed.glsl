// An adjoint pass in which some texels gather from too many pixels for one invocation: those of a block (SUMMED_ROWS of
// params.h). With PARTIAL_SUMS a pass writes their sums of groups of rows, which the pass after it adds up. Where
// an image would not hold all groups, there are such pairs of passes for several bands of rows. The including shader
// defines gather(), which adds up the pixels of a texel in the rows from `first` to `last`, SUMMED_IMAGE, whose rows
// these are, and SUMS_IMAGE, the image of the first pass.

vec4 gather(ivec2 texel, int first, int last);

vec4 gather_summed()
{
    ivec2 start = ivec2(params.summed_x, params.summed_y);
    ivec2 block = ivec2(params.summed_width, params.summed_height);
    int bottom = textureSize(SUMMED_IMAGE, 0).y - 1, rows = params.summed_rows;
    if (PARTIAL_SUMS != 0) {
        ivec2 tile = PIXEL / block;
        int first = params.summed_first + (tile.y * params.summed_columns + tile.x) * rows;
        return gather(start + PIXEL - tile * block, first, min(first + rows - 1, bottom));
    }
    if (any(lessThan(PIXEL, start)) || any(greaterThanEqual(PIXEL, start + block)))
        return params.summed_first == 0 ? gather(PIXEL, 0, bottom) : vec4(0.0);
    vec4 sum = vec4(0.0);
    for (int group = 0; group < params.summed_groups; ++group) {
        ivec2 tile = ivec2(group % params.summed_columns, group / params.summed_columns);
        sum += texelFetch(SUMS_IMAGE, tile * block + PIXEL - start, 0);
    }
    return sum;
}
