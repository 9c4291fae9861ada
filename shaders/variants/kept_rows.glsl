// A pass that writes strips from top to bottom, and keeps the rows of the source that a pixel needs, each with what
// its columns share. The including shader defines COLUMNS, ROWS, the number of rows KEPT, which is even, and the
// functions below. A pixel needs KEPT / 2 rows up to the texel at or before its position, and as many after it.
//
// What a shader keeps between two calls of its functions is in its own variables, not in arguments: the sizes of the
// arrays depend on specialization constants, and glslang copies as many elements of an argument as their defaults say.

// Defined by the including shader: computes what depends on columns alone; keeps a row in place of the uppermost one;
// writes the pixels of a row of the target, whose position in the source is this part of a texel after a texel. Rows
// of a doubling are of two phases in turns.
void start_columns(ivec2 first);
void keep_row(int first, int row);
void write_row(int first, int y, int texel, float part, int phase);

// Where the ratio of heights is simple (EXACT_ROWS): the rows of the source and of the target that are next to each
// other in the same way again. Loops of constant length: without them `dual_kawase` takes 84 ms in place of 65
// (processor time of 1920 x 1080 in float16, lavapipe of Mesa 22.3.6, 2026-11-27).
const int ROWS_IN = EXACT_ROWS == EXACT_HALF ? 2 : 1, ROWS_OUT = EXACT_ROWS == EXACT_DOUBLE ? 2 : 1;

// The position of a pixel is this part of a texel after a texel.
float exact_part(int phase)
{
    if (EXACT_ROWS == EXACT_DOUBLE)
        return phase == 0 ? 0.75 : 0.25;
    return EXACT_ROWS == EXACT_HALF ? 0.5 : 0.0;
}

// Each round keeps ROWS_IN rows and writes ROWS_OUT. The rounds before the first pixel only keep rows. A moved filter
// may double to an odd number of rows.
void write_exact_rows(ivec2 first, int end)
{
    const int ROUNDS_BEFORE = KEPT / ROWS_IN + ROWS_OUT - 2;
    int start = first.y / ROWS_OUT, rounds = (end + ROWS_OUT - 1) / ROWS_OUT;

    for (int round = start - ROUNDS_BEFORE; round < rounds; ++round) {
        int texel = ROWS_IN * round, new_row = texel - ROWS_IN + KEPT / 2 + 1;
        [[unroll]] for (int phase = 0; phase < ROWS_OUT; ++phase) {
            // The first of two pixels is before the centre of this texel: it needs no new row.
            bool is_last = phase == ROWS_OUT - 1;
            if (is_last)
                [[unroll]] for (int i = 0; i < ROWS_IN; ++i)
                    keep_row(first.x, new_row + i);
            if (round >= start && (ROWS_OUT == 1 || ROWS_OUT * round + phase < end))
                write_row(first.x, ROWS_OUT * round + phase, is_last ? texel : texel - 1, exact_part(phase), phase);
        }
    }
}

void write_rows(ivec2 first, int end)
{
    // The position of a row as in place_in_size(): a texel, and a rest in parts of a texel / divisor. For the next row
    // a step is added to the rest, in place of a quotient for each row.
    uint height = uint(READ_SIZE(SLOT_SOURCE).y), target_height = uint(params.target_height);
    uint step_down = 2u * height, divisor = 2u * target_height;
    uint number = uint(2 * first.y + 1) * height + target_height;
    uint rest = number % divisor;
    int texel = int(number / divisor) - 1;
    int new_row = texel - KEPT / 2 + 1;

    for (int y = first.y; y < end;) {
        // A position has at least one new row if the target is not higher than the source. llvmpipe runs
        // what a loop contains once more than it must if the condition comes first.
        do {
            keep_row(first.x, new_row);
            ++new_row;
        } while (new_row <= texel + KEPT / 2);
        // If it is not smaller, a row has at least one position.
        do {
            write_row(first.x, y, texel, float(rest) / float(divisor), 0);
            rest += step_down;
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
