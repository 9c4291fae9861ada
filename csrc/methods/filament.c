// Filament's bloom at its low quality. Source: google/filament, filament/src/PostProcessManager.cpp
// @ 003e5005713c, bloom().
#include "methods/methods.h"
#include "passes/filter.h"

#include <math.h>

// The sides of level 0 are multiples of this.
enum { FILAMENT_STEP = 16 };

static uint32_t stepped(double side)
{
    const double steps = floor(side / FILAMENT_STEP);
    return FILAMENT_STEP * (steps < 1.0 ? 1 : (uint32_t)steps);
}

static void choose_sizes(struct vkb_levels *levels)
{
    const struct vkb_values *values = &levels->settings->values;
    const struct vkb_size frame = levels->source->buffers;
    const double height = values->resolution;
    const double width = fmin(height * frame.width / frame.height, vkb_widest_level(levels));
    const uint32_t most = (uint32_t)log2(floor(fmax(width, height))) + 1;
    const uint32_t wanted = (uint32_t)values->levels, count = wanted < most ? wanted : most;
    struct vkb_size size = {stepped(width), stepped(height)};

    for (; levels->count < count; size = vkb_halved(size))
        levels->sizes[levels->count++] = size;
}

// A 3 x 3 binomial filter of `from` at the target's pixels. The first one of a frame applies the
// threshold and the mask.
static bool add_reduction(const struct vkb_levels *levels, uint32_t from, uint32_t to,
                          struct vkb_error *error)
{
    struct vkb_pass_row row = vkb_groups_row(levels, GROUPS_FILAMENT, from, to);

    if (from == levels->source->glow)
        vkb_mask_prefilter(levels, &row);
    else
        row.constants.thresholded = 0;
    return vkb_graph_add_pass(levels->graph, &row, error);
}

// Halves the frame until level 0 is larger than half of the result. *image is the image that level
// 0 reads.
static bool add_halvings(const struct vkb_levels *levels, uint32_t *image, struct vkb_error *error)
{
    const struct vkb_size least = levels->sizes[0];
    struct vkb_size size = levels->source->buffers;

    *image = levels->source->glow;
    for (uint32_t i = 0; 2 * least.width < size.width || 2 * least.height < size.height; ++i) {
        const uint32_t from = *image;
        size = vkb_halved(size);
        if (!vkb_levels_step(levels, "half_%u", i, size, image, error)
            || !add_reduction(levels, from, *image, error))
            return false;
    }
    return true;
}

// A level with even sides: 3 x 3 bilinear taps that approximate a Gaussian (bloomDownsample9.mat
// @ 523a261b1052).
static bool add_down(const struct vkb_levels *levels, uint32_t level, struct vkb_error *error)
{
    const uint32_t from = levels->downs[level - 1];
    const struct vkb_size above = levels->sizes[level - 1];
    const bool even = above.width % 2 == 0 && above.height % 2 == 0;
    const uint32_t to = levels->downs[level];
    const struct vkb_side_taps taps = {FILAMENT_OFFSET, FILAMENT_OUTER, 1.0 - 2.0 * FILAMENT_OUTER};
    struct vkb_pass_row row = vkb_filter_row(levels, from, to, 1.0);

    vkb_filter_add(&row, 0, taps, taps);
    return even ? vkb_filter_end(levels, &row, error)
                : vkb_levels_reduce(levels, 1.0, 1.0, from, to, error);
}

bool vkb_add_filament(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                      struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    struct vkb_levels levels = {.settings = settings, .source = source, .graph = graph};
    struct vkb_combination combination = vkb_combine(UPSAMPLE_TENT, 1.0, 1.0);
    uint32_t reduced;

    choose_sizes(&levels);
    if (!add_halvings(&levels, &reduced, error))
        return false;
    for (uint32_t level = 0; level < levels.count; ++level)
        if (!vkb_levels_down(&levels, level, error)
            || !(level ? add_down(&levels, level, error)
                       : add_reduction(&levels, reduced, levels.downs[0], error)))
            return false;
    combination.last_kernel = UPSAMPLE_LINEAR;
    combination.target_step = true;
    combination.gain = 1.0 / levels.count;
    return vkb_levels_combine(&levels, &combination, bloom, error);
}
