// The highlights of Blender's Glare node (formulas of the compositor of Blender 4.5).

// The value that a smooth transition of this width subtracts (minimum) or adds (maximum) at a
// distance from it (Quilez, "Smooth minimum").
float rounding(float distance_to_end, float width)
{
    float h = width > 0.0 ? max(1.0 - abs(distance_to_end) / width, 0.0) : 0.0;
    return 0.25 * h * h * width;
}

// The brightness above the threshold.
float highlight(float value)
{
    float low = params.threshold, range = params.maximum, high = low + range;
    // The widths are limited, so that the transitions stay between 0 and the other end.
    float at_low = min(params.smoothness, min(low, range));
    float at_high = min(params.smoothness, min(high, range));
    float above = value - low;
    float kept = max(above, 0.0) + rounding(above, at_low);
    return min(kept, range) - rounding(kept - range, at_high);
}

vec4 highlights(vec4 value)
{
    if (THRESHOLDED == 0)
        return value;
    float brightest = max(value.r, max(value.g, value.b));
    return brightest > 0.0 ? value * (highlight(brightest) / brightest) : vec4(0.0);
}
