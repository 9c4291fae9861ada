// The bloom of Babylon.js' DefaultRenderingPipeline. Source: BabylonJS/Babylon.js, bloomEffect.ts
// @ 05c105649f04, thinBlurPostProcess.ts @ 076e49a15333, kernelBlur.fragment.fx @ 445b0404049f.
#include "methods/methods.h"
#include "passes/prefilter.h"

uint32_t vkb_add_babylon_method(struct vkb_levels *levels)
{
    const struct vkb_settings *settings = levels->settings;
    const struct vkb_size frame = levels->source->buffers;
    // Pairs of taps that are read as one sample are equal to single taps, since the sizes are.
    struct vkb_kernel kernel = {.count = settings->weight_count};
    const double scale = settings->values.scale_x;

    for (uint32_t tap = 0; tap < kernel.count; ++tap)
        kernel.weights[tap] = settings->weights[tap];
    levels->sizes[levels->count++] =
        (struct vkb_size){vkb_scaled(frame.width, scale), vkb_scaled(frame.height, scale)};
    const uint32_t bright = vkb_levels_image(levels, levels->sizes[0], "bright");
    struct vkb_pass_row row =
        vkb_describe_prefilter(levels, VKB_PREFILTER_babylon, levels->source->glow, bright);
    vkb_levels_masked(levels, &row);
    vkb_levels_blur(levels, 0, bright, &kernel, UPSAMPLE_LINEAR);
    return vkb_levels_enlarge(levels, UPSAMPLE_LINEAR, levels->downs[0], 1.0);
}
