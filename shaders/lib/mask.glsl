// The mask of what glows, for a shader that reads it at binding 2 after its source and has SAMPLING_ROWS.
// It is read bilinearly at the position of this pixel.

layout(set = 0, binding = 2) uniform sampler2D mask;

float mask_value()
{
    if (MASKED == 0)
        return 1.0;
    return sample_at(mask, PLACE_IN(mask), vec2(0.0), SAMPLING).r;
}
