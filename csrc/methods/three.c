// three.js' UnrealBloomPass and BloomNode. Source: mrdoob/three.js, examples/jsm/postprocessing/
// UnrealBloomPass.js with the kernels of #31528 and the factor of #32517, in r187 the merged taps
// of #34479; examples/jsm/tsl/display/BloomNode.js @ 07e4c12b3840.
#include "methods/methods.h"
#include "passes/prefilter.h"

#include <math.h>

enum { THREE_LEVELS = 5 };

// The taps of each level's half-kernel, with the centre. The standard deviation is a third of this.
static const uint32_t tap_counts[THREE_LEVELS] = {6, 10, 14, 18, 22};

// The factors of the levels for a radius of 0. A radius of 1 mirrors them at 0.6.
static const double bloom_factors[THREE_LEVELS] = {1.0, 0.8, 0.6, 0.4, 0.2};

static bool is_node(const struct vkb_settings *settings)
{
    return settings->choices[VKB_CHOICE_variant] == VARIANT_NODE;
}

// The pass rounds the half size, the node floors it.
static struct vkb_size half_of(const struct vkb_settings *settings, struct vkb_size size)
{
    return is_node(settings) ? vkb_halved(size) : vkb_halved_up(size);
}

// Of "bright" and of the first level.
static struct vkb_size first_of(const struct vkb_settings *settings, struct vkb_size frame)
{
    const double scale = settings->values.scale_x;

    if (!is_node(settings))
        return half_of(settings, frame);
    return (struct vkb_size){vkb_scaled(frame.width, scale), vkb_scaled(frame.height, scale)};
}

// Two neighbouring taps become one sample between them.
static void merge(struct vkb_kernel *kernel)
{
    uint32_t merged = 1;

    for (uint32_t i = 1; i < kernel->count; i += 2) {
        const double a = kernel->weights[i];
        const double b = i + 1 < kernel->count ? kernel->weights[i + 1] : 0.0;
        kernel->offsets[merged] = (i * a + (i + 1) * b) / (a + b);
        kernel->weights[merged] = (float)(a + b);
        ++merged;
    }
    kernel->count = merged;
    kernel->placed = true;
}

static void add_level(struct vkb_levels *levels, uint32_t level, uint32_t from)
{
    const double deviation = tap_counts[level] / 3.0;
    struct vkb_kernel kernel = {.count = tap_counts[level]};

    for (uint32_t i = 0; i < kernel.count; ++i)
        kernel.weights[i] =
            (float)(0.39894 * exp(-0.5 * i * i / (deviation * deviation)) / deviation);
    if (levels->settings->choices[VKB_CHOICE_variant] != VARIANT_R185)
        merge(&kernel);
    vkb_levels_blur(levels, level, from, &kernel, UPSAMPLE_LINEAR);
}

// Multiplies the levels by the tints, three factors for each level.
static void add_tints(struct vkb_levels *levels, const float *all_tints)
{
    for (uint32_t level = 0; level < levels->count; ++level) {
        const float *tints = all_tints + 3 * level;
        if (tints[0] == 1.0f && tints[1] == 1.0f && tints[2] == 1.0f)
            continue;
        const uint32_t tinted = vkb_levels_step(levels, levels->sizes[level], "tinted_%u", level);
        struct vkb_pass_row row =
            vkb_describe_prefilter(levels, VKB_PREFILTER_tint, levels->downs[level], tinted);
        row.constants.thresholded = false;
        vkb_set_tint(&row, tints);
        vkb_levels_pass(levels, &row);
        levels->downs[level] = tinted;
    }
}

uint32_t vkb_add_three_method(struct vkb_levels *levels)
{
    const struct vkb_settings *settings = levels->settings;
    double shares[THREE_LEVELS];
    struct vkb_size size = levels->source->buffers;
    double total = 0.0;

    for (uint32_t level = 0; level < THREE_LEVELS; ++level) {
        const double factor = bloom_factors[level];
        size = level ? half_of(settings, size) : first_of(settings, size);
        levels->sizes[level] = size;
        shares[level] = factor + (1.2 - 2.0 * factor) * settings->values.radius;
        total += shares[level];
    }
    levels->count = THREE_LEVELS;
    // A format whose largest value is 1 holds the mean of the levels, and the bloom is multiplied
    // by `total`.
    if (!vkb_stores_means(levels->source->format))
        total = 1.0;
    for (uint32_t level = 0; level < THREE_LEVELS; ++level)
        shares[level] /= total;
    uint32_t from = vkb_levels_image(levels, levels->sizes[0], "bright");
    // From r187 on the luminance has the weights of three.js' colour management.
    const enum vkb_prefilter prefilter = settings->choices[VKB_CHOICE_variant] == VARIANT_R185
                                           ? VKB_PREFILTER_three
                                           : VKB_PREFILTER_three_node;
    struct vkb_pass_row row = vkb_describe_prefilter(levels, prefilter, levels->source->glow, from);
    vkb_levels_masked(levels, &row);
    for (uint32_t level = 0; level < levels->count; ++level) {
        add_level(levels, level, from);
        from = levels->downs[level];
    }
    add_tints(levels, settings->level_weights);
    const uint32_t sum = vkb_levels_image(levels, levels->sizes[0], "up_0");
    vkb_levels_gather(levels, shares, UPSAMPLE_LINEAR, sum);
    return vkb_levels_enlarge(levels, UPSAMPLE_LINEAR, sum, total);
}
