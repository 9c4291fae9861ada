// An adjoint pass in which some texels gather from too many pixels for one invocation: those near a centre, in blocks
// around it that contain each other (SUMMED_ROWS of params.h). The nearer a block, the more groups have its pixels. With
// PARTIAL_SUMS a pass writes the sum of each group for each texel of the blocks, which the pass after it adds up. The
// including shader defines SUMS_IMAGE, the image of the first pass.

// Of a block: its first texel and its size; how many groups it has, how many of these are beside each other in the
// image of sums, and where these begin.
struct Summed {
    ivec4 place;
    int groups, columns, top;
};

Summed summed_at(int number)
{
    vec4 in_image = params.summed[2 * number + 1];
    return Summed(ivec4(params.summed[2 * number]), int(in_image.x), int(in_image.y), int(in_image.z));
}

// The number of the smallest block with a texel; -1: it is in none.
int number_of_block(ivec2 texel)
{
    for (int number = 0; number < params.summed_blocks; ++number) {
        ivec4 place = ivec4(params.summed[2 * number]);
        if (all(greaterThanEqual(texel, place.xy)) && all(lessThan(texel, place.xy + place.zw)))
            return number;
    }
    return -1;
}

// The texel of whose pixels one group is added up, and how many groups there are; 0: there is none.
struct Gathered {
    ivec2 texel;
    int group, groups;
};

// What a pixel of the image of sums is.
Gathered gathered_at(ivec2 pixel)
{
    int number = params.summed_blocks - 1;
    while (number > 0 && pixel.y < summed_at(number).top)
        --number;
    Summed block = summed_at(number);
    ivec2 at = pixel - ivec2(0, block.top), tile = at / block.place.zw;
    ivec2 texel = block.place.xy + at - tile * block.place.zw;
    int group = tile.y * block.columns + tile.x;
    bool exists = tile.x < block.columns && group < block.groups && number_of_block(texel) == number;
    return Gathered(texel, group, exists ? block.groups : 0);
}

// The sum of all groups of a texel in a block.
vec4 sum_of_groups(ivec2 texel)
{
    Summed block = summed_at(number_of_block(texel));
    ivec2 start = texel - block.place.xy + ivec2(0, block.top);
    vec4 sum = vec4(0.0);
    for (int group = 0; group < block.groups; ++group) {
        ivec2 tile = ivec2(group % block.columns, group / block.columns);
        sum += texelFetch(SUMS_IMAGE, start + tile * block.place.zw, 0);
    }
    return sum;
}

// The first number from `start` on, 0 or above, that is one of a group: its numbers are `groups` apart.
int first_of_group(int start, int group, int groups)
{
    int left = group - start % groups;
    return start + (left < 0 ? left + groups : left);
}
