// Filters an image for this pixel. Include fullscreen.glsl and filter.glsl before this file.

vec4 row_of(sampler2D image, int kernel, Axis row, int line)
{
    vec4 sum = vec4(0.0);
    [[unroll]] for (int i = 0; i < TAP_COUNT; ++i) {
        float moved = row.part + FILTER_X(i).x, integer = floor(moved), part = moved - integer;
        float weight = FILTER_X(i)[kernel + 1];
        ivec2 texel = ivec2(row.texel + int(integer), line);
        if (weight != 0.0)
            sum += weight * (1.0 - part) * fetch_clamped(image, texel)
                 + weight * part * fetch_clamped(image, texel + ivec2(1, 0));
    }
    return sum;
}

// Taps that are too far apart for a window.
vec4 sparse(sampler2D image, Axis row, Axis column)
{
    vec4 sum = vec4(0.0);
    [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel) {
        vec4 part_sum = vec4(0.0);
        [[unroll]] for (int i = 0; i < TAP_COUNT; ++i) {
            float moved = column.part + FILTER_Y(i).x, integer = floor(moved);
            float part = moved - integer, weight = FILTER_Y(i)[kernel + 1];
            int line = column.texel + int(integer);
            if (weight != 0.0)
                part_sum += weight * (1.0 - part) * row_of(image, kernel, row, line)
                          + weight * part * row_of(image, kernel, row, line + 1);
        }
        sum += part_sum;
    }
    return sum;
}

vec4 filtered(sampler2D image)
{
    ivec2 size = textureSize(image, 0), target_size = ivec2(params.target_width, params.target_height);
    Place place = position_of(size, PIXEL, target_size);
    vec2 ratio = vec2(size) / vec2(target_size);
    place.texel += ivec2(params.first_x, params.first_y);
    Axis row = settled(axis_of(place, size, ratio, 0)), column = settled(axis_of(place, size, ratio, 1));
    if (WINDOW == 0)
        return sparse(image, row, column);
    Window x = window_of(row, WINDOW, true), y = window_of(column, WINDOW, false);
    vec4 sums[3] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
    [[unroll]] for (int i = 0; i < WINDOW; ++i) {
        vec4 rows[3] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
        [[unroll]] for (int j = 0; j < WINDOW; ++j) {
            vec4 texel = fetch_clamped(image, ivec2(x.first + j, y.first + i));
            [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
                if (has_weight(TAKEN_X, j, kernel))
                    rows[kernel] += x.weights[j][kernel] * texel;
        }
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
            if (has_weight(TAKEN_Y, i, kernel))
                sums[kernel] += y.weights[i][kernel] * rows[kernel];
    }
    return sum_of(sums);
}
