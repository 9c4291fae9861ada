#version 450
#extension GL_GOOGLE_include_directive : require
// The complete bloom of an image for processors without fast shared memory: an invocation walks down a
// strip, with the vertical sums of the rows to come in registers.
#include "variants/fused_bloom.glsl"

layout(local_size_x = ROW_INVOCATIONS) in;
layout(set = 0, binding = 1, SOURCE_FORMAT) uniform readonly image2D image;
layout(set = 0, binding = 2) uniform writeonly image2D target;

const int SUMS = 2 * STRIP_RADIUS;
const int LOADED = STRIP_COLUMNS + 2 * STRIP_RADIUS;

void main()
{
    ivec2 last = imageSize(image) - 1;
    ivec2 first = ivec2(gl_GlobalInvocationID.xy) * ivec2(STRIP_COLUMNS, STRIP_ROWS);
    int end = min(first.y + STRIP_ROWS, last.y + 1);
    vec3 sums[SUMS][LOADED];
    vec3 line[LOADED];
    vec3 bloom[STRIP_COLUMNS];

    if (any(greaterThan(first, last)))
        return;
    for (int row = 0; row < SUMS; ++row)
        for (int i = 0; i < LOADED; ++i)
            sums[row][i] = vec3(0.0);
    for (int y = first.y - STRIP_RADIUS; y < end + STRIP_RADIUS; ++y) {
        int row = clamp(y, 0, last.y);
        // In small loops, each of which drivers unroll; in one large one the sums would be memory.
        for (int i = 0; i < LOADED; ++i)
            line[i] = thresholded(imageLoad(image, ivec2(clamp(first.x + i - STRIP_RADIUS, 0, last.x), row)).rgb);
        for (int i = 0; i < LOADED; ++i) {
            vec3 added = line[i];
            // The row that ends here, and those to come, each one place further.
            line[i] = as_stored(sums[0][i] + vertical_weight(STRIP_RADIUS) * added, FORMAT);
            for (int tap = 1; tap < SUMS; ++tap)
                sums[tap - 1][i] = sums[tap][i] + vertical_weight(STRIP_RADIUS - tap) * added;
            sums[SUMS - 1][i] = vertical_weight(STRIP_RADIUS) * added;
        }
        if (y < first.y + STRIP_RADIUS)
            continue;
        for (int i = 0; i < STRIP_COLUMNS; ++i) {
            vec3 sum = vec3(0.0);
            for (int tap = -STRIP_RADIUS; tap <= STRIP_RADIUS; ++tap)
                sum += horizontal_weight(tap) * line[i + STRIP_RADIUS + tap];
            bloom[i] = as_stored(sum, FORMAT);
        }
        for (int i = 0; i < STRIP_COLUMNS; ++i) {
            ivec2 pixel = ivec2(first.x + i, y - STRIP_RADIUS);
            if (pixel.x <= last.x)
                imageStore(target, pixel,
                           finish(imageLoad(image, pixel), vec4(bloom[i], 1.0), pixel));
        }
    }
}
