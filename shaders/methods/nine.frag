// The blurs of nine taps in one direction, pixels of the target apart.
//
// HDRP's binomial filter reduces the image along this direction (Unity-Technologies/Graphics,
// com.unity.render-pipelines.high-definition, BloomBlur.compute @ 0e4ca4d79b2c). Before the first texel of the
// first level, the first two texels alternate. Before the first texel of other levels, and after the last pixel,
// the outermost sample is repeated.
//
// Of Godot's, the horizontal one samples the larger image at the level's pixels; the vertical one completes the
// level (godotengine/godot, copy.glsl @ 0a5efd02df51).
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, source);

#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"
#include "lib/nine.glsl"
#include "lib/nine_taps.glsl"

vec4 shade()
{
    vec4 sum = nine_sum();
    bool ends_level = DIRECTION == DIRECTION_VERTICAL;
    if (IS_GODOT && ends_level)
        sum = HAS_POINT_AFTER ? mask_value() * apply_point(POINT_AFTER, sum) : params.strength * sum;
    return stored(sum);
}
