// three.js' UnrealBloomPass. Source: mrdoob/three.js, examples/jsm/postprocessing/
// UnrealBloomPass.js, the variant with the kernels of #31528 and the factor of #32517.
#include "methods/methods.h"
#include "passes/levels.h"

#include <math.h>

enum { UNREAL_LEVELS = 5, UNREAL_LONGEST = 22 };

// The taps of each level's half-kernel, with the centre. The standard deviation is a third of this.
static const uint32_t tap_counts[UNREAL_LEVELS] = {6, 10, 14, 18, UNREAL_LONGEST};

// The factors of the levels for a radius of 0. A radius of 1 mirrors them at 0.6.
static const double bloom_factors[UNREAL_LEVELS] = {1.0, 0.8, 0.6, 0.4, 0.2};

// The pass rounds the half size, the node floors it.
static struct vkb_size half_of(const struct vkb_settings *settings, struct vkb_size size)
{
    return settings->values.node ? vkb_halved(size)
                                 : (struct vkb_size){(size.width + 1) / 2, (size.height + 1) / 2};
}

static bool add_level(struct vkb_levels *levels, uint32_t level, uint32_t from,
                      struct vkb_error *error)
{
    float weights[UNREAL_LONGEST];
    const double deviation = tap_counts[level] / 3.0;
    const struct vkb_kernel kernel = {.weights = weights, .count = tap_counts[level]};

    for (uint32_t i = 0; i < kernel.count; ++i)
        weights[i] = (float)(0.39894 * exp(-0.5 * i * i / (deviation * deviation)) / deviation);
    return vkb_levels_blur(levels, level, from, &kernel, error);
}

bool vkb_add_unreal(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                    struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    struct vkb_levels levels = {.settings = settings, .source = source, .graph = graph};
    double shares[UNREAL_LEVELS];
    struct vkb_size size = source->buffers;
    double total = 0.0;
    uint32_t from, sum;

    for (; levels.count < UNREAL_LEVELS; ++levels.count) {
        const double factor = bloom_factors[levels.count];
        levels.sizes[levels.count] = size = half_of(settings, size);
        shares[levels.count] = factor + (1.2 - 2.0 * factor) * settings->values.radius;
        total += shares[levels.count];
    }
    // A format whose largest value is 1 holds the mean of the levels, and the bloom is multiplied
    // by `total`.
    if (!vkb_stores_means(source->format))
        total = 1.0;
    for (uint32_t level = 0; level < UNREAL_LEVELS; ++level)
        shares[level] /= total;
    if (!vkb_levels_image(&levels, "bright", 0, levels.sizes[0], &from, error))
        return false;
    struct vkb_pass_row row = vkb_groups_row(&levels, GROUPS_UNREAL, source->glow, from);
    row.constants.node = settings->values.node;
    vkb_mask_prefilter(&levels, &row);
    if (!vkb_graph_add_pass(graph, &row, error))
        return false;
    for (uint32_t level = 0; level < levels.count; from = levels.downs[level++])
        if (!add_level(&levels, level, from, error))
            return false;
    return vkb_levels_image(&levels, "up_%u", 0, levels.sizes[0], &sum, error)
        && vkb_levels_gather(&levels, shares, UPSAMPLE_LINEAR, sum, error)
        && vkb_levels_enlarge(&levels, sum, total, bloom, error);
}
