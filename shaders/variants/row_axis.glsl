// The position of a row of the target in an image of this size, both of which may be bands of rows.
Axis row_axis(ivec2 size, int y, int kind, float tap_step)
{
    ivec2 target_size = ivec2(params.target_width, params.target_height);
    ivec2 complete = ivec2(size.x, params.source_height == 0 ? size.y : params.source_height);
    Place place = place_in_rows(complete, ivec2(0, y), target_size, params.row_offset);
    return axis_y(place, kind, tap_step, size, vec2(complete) / vec2(target_size));
}
