// The transpose of a filter (adjoint_filter.frag) in tiles: a filter of the cotangents whose windows are the pixels
// that read a texel, by the table.

UNIFORM_BLOCK(ADJOINT_FILTER_BLOCK);
#include "lib/window.glsl"

layout(set = 0, binding = 1) uniform sampler2D cotangents;
layout(set = 0, binding = 2) uniform sampler2D table;
layout(set = 0, binding = 3) uniform sampler2D scene;
layout(set = 0, binding = 4) uniform sampler2D added;
layout(set = 0, binding = 5) uniform sampler2D differentiated;
layout(set = 0, binding = 6) uniform writeonly image2D target;
#define IS_TRANSPOSED true
#include "variants/filter_tile.glsl"

vec4 entry(int place)
{
    return texelFetch(table, ivec2(place % TABLE_WIDTH, place / TABLE_WIDTH), 0);
}

// Windows in a simple ratio begin as those of filters. Pixels that do not read the texel have no weight.
Window window_at(ivec2 pixel, bool along_x)
{
    ivec2 within = min(pixel, imageSize(target) - 1);
    int at_texel = along_x ? within.x : within.y;
    ivec4 readers = ivec4(entry(at_texel + (along_x ? params.start_x : params.start_y)));
    Window window;
    int exact = along_x ? EXACT : EXACT_ROWS, at_pixel = along_x ? pixel.x : pixel.y;
    window.first = exact != 0 ? exact_first(exact, at_pixel) : readers.x;
    [[unroll]] for (int i = 0; i < WINDOW; ++i) {
        int at = window.first + i, number = at_texel % ADJOINT_SIDE;
        window.weights[i] = vec3(0.0);
        if (at >= readers.x && at < readers.x + readers.y)
            window.weights[i] = LEVELS == 1 ? vec3(entry(readers.z + at - readers.w)[number])
                                            : entry(readers.z + ADJOINT_SIDE * (at - readers.w) + number).xyz;
    }
    return window;
}

vec4 texel_at(ivec2 texel)
{
    ivec2 within = clamp(texel, ivec2(0), textureSize(cotangents, 0) - 1);
    vec4 value = texelFetch(cotangents, within, 0);
    return BY == BY_BLOOM ? vec4(where_finite(value, texelFetch(scene, within, 0)).rgb, 0.0) : value;
}

vec4 own_at(ivec2 pixel)
{
    return ADD_OWN != 0 ? vec4(vec3(params.share), 1.0) * texelFetch(added, pixel, 0) : vec4(0.0);
}

vec4 shade(vec4 own, vec4 sum, ivec2 pixel)
{
    sum = params.gain * sum + own;
    return FROM_IMAGE != 0 ? where_finite(sum, texelFetch(differentiated, pixel, 0)) : sum;
}
