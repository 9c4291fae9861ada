// A texel of the image that a downsampling reads itself in place of the threshold pass's result.
vec4 thresholded(vec4 value)
{
    if (FROM_IMAGE == 0)
        return value;
    vec4 kept =
        apply_threshold(finite_or_zero(value), THRESHOLD_MODE, params.threshold, params.knee);
    // Without a knee the value is the texel or 0, which needs no rounding.
    return THRESHOLD_MODE == THRESHOLD_KNEE ? as_stored(kept, FORMAT) : kept;
}
