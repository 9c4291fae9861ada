// Blocks whose rows are independent. The including shader defines write_row(), which computes and stores the pixels
// of one row.
void write_block(ivec2 first, int end)
{
    for (int y = first.y; y < end; ++y)
        write_row(first.x, y);
}

#include "variants/blocks.glsl"
