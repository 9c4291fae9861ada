// The mask of what glows, for a shader with SAMPLING_ROWS.
// It is read bilinearly at the position of this pixel.

SAMPLED_IMAGE(SLOT_MASK, mask);

float mask_value()
{
    if (MASKED == 0)
        return 1.0;
    return sample_at(mask, PLACE_IN(mask), vec2(0.0), SAMPLING).r;
}
