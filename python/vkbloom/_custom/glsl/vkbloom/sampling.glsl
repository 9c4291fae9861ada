// The filters of the package's chains: p is a place in 0..1, the source is filtered linearly.
#ifndef VKBLOOM_SAMPLING
#define VKBLOOM_SAMPLING

vec4 corners(sampler2D image, vec2 p, vec2 distance) {
    return textureLod(image, p - distance, 0.0) + textureLod(image, p + distance, 0.0) +
           textureLod(image, p + vec2(distance.x, -distance.y), 0.0) +
           textureLod(image, p + vec2(-distance.x, distance.y), 0.0);
}

vec4 axials(sampler2D image, vec2 p, vec2 distance) {
    return textureLod(image, p - vec2(distance.x, 0.0), 0.0) +
           textureLod(image, p + vec2(distance.x, 0.0), 0.0) +
           textureLod(image, p - vec2(0.0, distance.y), 0.0) +
           textureLod(image, p + vec2(0.0, distance.y), 0.0);
}

// Thirteen taps that halve an image: 1/8 the centre and the corners at one texel, 1/16 the axial
// ones and 1/32 the corners at two.
vec4 thirteen_taps(sampler2D image, vec2 p) {
    vec2 texel = 1.0 / vec2(textureSize(image, 0));
    return 0.125 * (textureLod(image, p, 0.0) + corners(image, p, texel)) +
           0.0625 * axials(image, p, 2.0 * texel) + 0.03125 * corners(image, p, 2.0 * texel);
}

// A tent of 3 x 3 taps, (1 2 1)^2 / 16, at `radius` texels of the image.
vec4 tent(sampler2D image, vec2 p, float radius) {
    vec2 step = radius / vec2(textureSize(image, 0));
    return (4.0 * textureLod(image, p, 0.0) + 2.0 * axials(image, p, step) +
            corners(image, p, step)) / 16.0;
}

// Dual Kawase, down: (4 c + the corners at `offset` times half a texel) / 8.
vec4 kawase_down(sampler2D image, vec2 p, float offset) {
    vec2 half_texel = 0.5 * offset / vec2(textureSize(image, 0));
    return (4.0 * textureLod(image, p, 0.0) + corners(image, p, half_texel)) / 8.0;
}

// Dual Kawase, up: (the axial ones at `offset` texels + 2 of the corners at half of it) / 12.
vec4 kawase_up(sampler2D image, vec2 p, float offset) {
    vec2 texel = offset / vec2(textureSize(image, 0));
    return (axials(image, p, texel) + 2.0 * corners(image, p, 0.5 * texel)) / 12.0;
}

#endif
