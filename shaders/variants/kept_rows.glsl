// A pass that writes strips from top to bottom, and keeps the rows of the source that a pixel needs, each with what
// its columns share. The including shader defines COLUMNS, ROWS, the number of rows KEPT, half of which are after a
// position's, and the functions below.

// Defined by the including shader: what depends on columns alone; a row takes the place of the uppermost one; the
// pixels of a row of the target, whose position in the source is this part of a texel after a texel.
void start_columns(ivec2 first);
void keep_row(int first, int row);
void write_row(int first, int y, int texel, float part, int phase);

// Where the ratio of heights is simple (EXACT_ROWS): the rows of the source and of the target that are next to each
// other in the same way again. Loops of constant length: without them `dual_kawase` takes 84 ms in place of 65
// (processor time of 1920 x 1080 in float16, lavapipe of Mesa 22.3.6, 2026-11-27).
const int ROWS_IN = EXACT_ROWS == EXACT_HALF ? 2 : 1, ROWS_OUT = EXACT_ROWS == EXACT_DOUBLE ? 2 : 1;

void write_exact_rows(ivec2 first, int end)
{
    int start = first.y / ROWS_OUT;
    for (int y = start - KEPT / ROWS_IN - ROWS_OUT + 2; y < end / ROWS_OUT; ++y)
        [[unroll]] for (int i = 0; i < ROWS_OUT; ++i) {
            if (i == ROWS_OUT - 1)
                [[unroll]] for (int j = 1; j <= ROWS_IN; ++j)
                    keep_row(first.x, ROWS_IN * (y - 1) + KEPT / 2 + j);
            float part = EXACT_ROWS == EXACT_HALF ? 0.5 : EXACT_ROWS == EXACT_SAME ? 0.0 : i == 0 ? 0.75 : 0.25;
            if (y >= start)
                write_row(first.x, ROWS_OUT * y + i, ROWS_IN * y + i - ROWS_OUT + 1, part, i);
        }
}

void write_rows(ivec2 first, int end)
{
    // The position as in place_in_size(), but with a rest in place of a quotient for each row.
    uint height = uint(READ_SIZE(SLOT_SOURCE).y);
    uint divisor = 2u * uint(params.target_height);
    uint number = uint(2 * first.y + 1) * height + divisor / 2u;
    uint rest = number % divisor;
    int texel = int(number / divisor) - 1, row = texel - KEPT / 2;

    for (int y = first.y; y < end;) {
        // A position has at least one new row if the target is not higher than the source. llvmpipe runs
        // what a loop contains once more than it must if the condition comes first.
        do {
            keep_row(first.x, ++row);
        } while (row < texel + KEPT / 2);
        // If it is not smaller, a row has at least one position.
        do {
            write_row(first.x, y, texel, float(rest) / float(divisor), 0);
            rest += 2u * height;
            ++y;
        } while (ENLARGED != 0 && rest < divisor && y < end);
        uint moved = rest / divisor;
        rest -= moved * divisor;
        texel += int(moved);
    }
}

void write_block(ivec2 first, int end)
{
    start_columns(first);
    if (EXACT_ROWS != 0)
        write_exact_rows(first, end);
    else
        write_rows(first, end);
}

#include "variants/blocks.glsl"
