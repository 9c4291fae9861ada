// An adjoint pass in which some texels gather from too many pixels for one invocation: those of a block.
// With STAGE_FIRST a pass writes their sums of groups of rows, which the pass with STAGE_LAST adds up.
// The including shader defines gather(), which adds up the pixels of a texel in the rows from `first` to
// `last`, SUMMED_IMAGE, whose rows these are, and PARTIAL_SUMS, the image of the first pass.

vec4 gather(ivec2 texel, int first, int last);

vec4 gather_summed()
{
    ivec2 start = ivec2(params.summed_x, params.summed_y), texel = PIXEL;
    ivec2 block = ivec2(params.summed_width, params.summed_height);
    int first = 0, last = textureSize(SUMMED_IMAGE, 0).y - 1, rows = params.summed_rows;
    if (STAGE == STAGE_FIRST) {
        ivec2 tile = PIXEL / block;
        texel += start - tile * block;
        first = (tile.y * params.summed_columns + tile.x) * rows;
        last = min(first + rows - 1, last);
    } else if (all(greaterThanEqual(PIXEL, start)) && all(lessThan(PIXEL, start + block))) {
        vec4 sum = vec4(0.0);
        for (int group = 0; group * rows <= last; ++group) {
            ivec2 tile = ivec2(group % params.summed_columns, group / params.summed_columns);
            sum += texelFetch(PARTIAL_SUMS, tile * block + PIXEL - start, 0);
        }
        return sum;
    }
    return gather(texel, first, last);
}
