// Stores a pixel to a target of single floats.
void store_float(int x, int row, vec4 value)
{
    int at = (row - target_shape.w) * target_shape.z + x;
    if (x < target_shape.x)
        runs_of_target.runs[at] = u64vec2(eighth(floatBitsToUint(value.rg)),
                                           eighth(floatBitsToUint(value.ba)));
}
