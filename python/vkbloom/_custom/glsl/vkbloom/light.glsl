// What glows: luminance, weights and thresholds.
#ifndef VKBLOOM_LIGHT
#define VKBLOOM_LIGHT

// Luminance of linear Rec. 709 colours.
float luminance(vec3 colour) { return dot(colour, vec3(0.2126, 0.7152, 0.0722)); }

// Karis' weight: bright pixels count less in an average.
float karis_weight(vec3 colour) { return 1.0 / (1.0 + luminance(colour)); }

// The threshold with a knee of all methods, as a factor of the colour, so that the hue stays.
float above_threshold(vec3 colour, float threshold, float knee) {
    float brightest = max(colour.r, max(colour.g, colour.b));
    float k = threshold * knee;
    float q = clamp(brightest - threshold + k, 0.0, 2.0 * k);
    return max(q * q / (4.0 * k + 1e-5), brightest - threshold) / max(brightest, 1e-5);
}

#endif
