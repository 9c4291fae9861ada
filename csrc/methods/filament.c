// Filament's bloom at its low quality. Source: google/filament, filament/src/PostProcessManager.cpp
// @ 003e5005713c, bloom().
#include "methods/methods.h"
#include "passes/filter.h"
#include "passes/prefilter.h"

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
    const struct vkb_size size = {stepped(width), stepped(height)};

    vkb_levels_add_sizes(levels, size, count);
}

// A 3 x 3 binomial filter of `from` at the target's pixels. The first one of a frame applies the
// threshold and the mask.
static void add_reduction(struct vkb_levels *levels, uint32_t from, uint32_t to)
{
    const bool first = from == levels->source->glow;
    const bool bright = first && levels->settings->thresholded;
    struct vkb_pass_row row = vkb_describe_prefilter(
        levels, bright ? VKB_PREFILTER_filament_bright : VKB_PREFILTER_filament, from, to);

    vkb_apply_mask(&row, first ? levels->source->mask : VKB_NO_IMAGE);
    row.constants.thresholded = bright;
    vkb_levels_pass(levels, &row);
}

// Halves the frame until level 0 is larger than half of the result. Returns the image that level 0
// reads.
static uint32_t add_halvings(struct vkb_levels *levels)
{
    const struct vkb_size least = levels->sizes[0];
    struct vkb_size size = levels->source->buffers;
    uint32_t from = levels->source->glow, to;

    for (uint32_t i = 0; 2 * least.width < size.width || 2 * least.height < size.height; ++i) {
        size = vkb_halved(size);
        to = vkb_levels_step(levels, size, "half_%u", i);
        add_reduction(levels, from, to);
        from = to;
    }
    return from;
}

// A level with even sides: 3 x 3 bilinear taps that approximate a Gaussian (bloomDownsample9.mat
// @ 523a261b1052).
static void add_down(struct vkb_levels *levels, uint32_t level)
{
    const uint32_t from = levels->downs[level - 1], to = vkb_levels_down(levels, level);
    const struct vkb_size above = levels->sizes[level - 1];
    struct vkb_filter filter;

    vkb_filter_begin(levels->graph, from, to, &filter);
    vkb_filter_three(&filter, FILAMENT_OFFSET, FILAMENT_OUTER);
    if (above.width % 2 == 0 && above.height % 2 == 0)
        vkb_add_filter_pass(levels, &filter, from, to);
    else
        vkb_levels_reduce(levels, 1.0, 1.0, from, to);
}

uint32_t vkb_add_filament_method(struct vkb_levels *levels)
{
    struct vkb_combination combination = vkb_combine(UPSAMPLE_TENT, 1.0, 1.0);

    choose_sizes(levels);
    const uint32_t reduced = add_halvings(levels);
    add_reduction(levels, reduced, vkb_levels_down(levels, 0));
    for (uint32_t level = 1; level < levels->count; ++level)
        add_down(levels, level);
    combination.last_kernel = UPSAMPLE_LINEAR;
    combination.target_step = true;
    combination.gain = 1.0 / levels->count;
    return vkb_levels_combine(levels, &combination);
}
