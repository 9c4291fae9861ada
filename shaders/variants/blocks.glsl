// The main function of a pass whose invocations write blocks of COLUMNS x ROWS pixels. The including shader defines
// both, and write_block(), which gets the first pixel of its block and the row after the last one.

layout(local_size_x = ROW_INVOCATIONS) in;

void main()
{
    copy_shapes();
    ivec2 first = first_pixel(ivec2(COLUMNS, ROWS)), size = TARGET_SIZE();

    if (all(lessThan(first, size)))
        write_block(first, min(first.y + ROWS, size.y));
}
