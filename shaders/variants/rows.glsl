// The main function of a pass whose rows are independent: an invocation writes a block of COLUMNS x
// ROWS pixels. The including shader defines both, and write_row(), which computes and stores the
// pixels of one row.
void main()
{
    copy_shapes();
    ivec2 size = TARGET_SIZE();
    ivec2 first = first_pixel(ivec2(COLUMNS, ROWS));
    int end = min(first.y + ROWS, size.y);

    if (any(greaterThanEqual(first, size)))
        return;
    for (int y = first.y; y < end; ++y)
        write_row(first.x, y);
}
