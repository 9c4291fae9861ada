#include "passes/levels.h"

#include "passes/blur.h"
#include "passes/filter.h"
#include "passes/tap_sets.h"

#include <math.h>
#include <string.h>

struct vkb_combination vkb_combine(enum vkb_mode kernel, double same_size, double coarse)
{
    struct vkb_combination combination = {
        .kernel = kernel,
        .last_kernel = kernel,
        .radius_x = 1.0,
        .radius_y = 1.0,
        .smallest = 1.0,
        .gain = 1.0,
    };

    for (int level = 0; level < MAX_LEVELS; ++level) {
        combination.same_size[level] = same_size;
        combination.coarse[level] = coarse;
    }
    return combination;
}

double vkb_widest_level(const struct vkb_levels *levels)
{
    const double widest = 16384.0, limit = levels->graph->max_width;

    return limit > 0.0 ? fmin(limit, widest) : widest;
}

static uint32_t half(uint32_t side)
{
    return side > 1 ? side / 2 : 1;
}

uint32_t vkb_scaled(uint32_t side, double scale)
{
    return (uint32_t)fmax(1.0, floor(scale * side));
}

struct vkb_size vkb_halved_up(struct vkb_size size)
{
    return (struct vkb_size){(size.width + 1) / 2, (size.height + 1) / 2};
}

struct vkb_size vkb_halved(struct vkb_size size)
{
    return (struct vkb_size){half(size.width), half(size.height)};
}

void vkb_levels_add_sizes(struct vkb_levels *levels, struct vkb_size first, uint32_t count)
{
    struct vkb_size size = first;

    while (levels->count < count) {
        levels->sizes[levels->count++] = size;
        size = vkb_halved(size);
    }
}

void vkb_levels_halve(struct vkb_levels *levels, struct vkb_size above, uint32_t count)
{
    struct vkb_size size = above;

    while (levels->count < count) {
        size = vkb_halved(size);
        if (levels->count > 0 && size.width == 1 && size.height == 1)
            break;
        levels->sizes[levels->count++] = size;
    }
}

// A pass that downsamples with the mean of a set of taps.
static void add_mean(struct vkb_levels *levels, enum vkb_tap_set set, double step_x, double step_y,
                     uint32_t from, uint32_t to)
{
    struct vkb_filter filter;

    vkb_filter_begin(levels->graph, from, to, &filter);
    vkb_filter_mean(&filter, (int32_t)set, step_x, step_y);
    vkb_add_filter_pass(levels, &filter, from, to);
}

void vkb_levels_box(struct vkb_levels *levels, uint32_t from, uint32_t to)
{
    add_mean(levels, TAPS_CORNERS, 1.0, 1.0, from, to);
}

void vkb_levels_reduce(struct vkb_levels *levels, double step_x, double step_y, uint32_t from,
                       uint32_t to)
{
    add_mean(levels, TAPS_THIRTEEN, step_x, step_y, from, to);
}

void vkb_levels_reduce_rest(struct vkb_levels *levels, double step_x, double step_y)
{
    for (uint32_t level = 1; level < levels->count; ++level)
        vkb_levels_reduce(levels, step_x, step_y, levels->downs[level - 1],
                          vkb_levels_down(levels, level));
}

struct vkb_pass_row vkb_prefilter_row(const struct vkb_levels *levels,
                                      const struct vkb_shader *fragment, uint32_t from, uint32_t to)
{
    const struct vkb_settings *settings = levels->settings;
    struct vkb_pass_row row = vkb_fetching_row(levels, fragment, from, to);

    row.constants.thresholded = settings->thresholded;
    row.block = VKB_BLOCK_prefilter;
    vkb_params_read(row.block, &settings->values, &row.params);
    if (!settings->thresholded) {
        row.params.prefilter.threshold = 0.0f;
        row.params.prefilter.knee = 0.0f;
    }
    for (int channel = 0; channel < 4; ++channel)
        row.params.prefilter.tint[0][channel] = 1.0f;
    VKB_SET_TARGET(&row, prefilter, &levels->graph->images[to]);
    vkb_apply_mask(&row, VKB_NO_IMAGE);
    return row;
}

// The row of a blur with the kernel along one axis.
static struct vkb_pass_row blur_row(struct vkb_levels *levels, const struct vkb_kernel *kernel,
                                    enum vkb_mode direction, enum vkb_mode kind, uint32_t from,
                                    uint32_t to)
{
    struct vkb_filter filter;

    vkb_filter_begin(levels->graph, from, to, &filter);
    if (direction == DIRECTION_VERTICAL) {
        filter.y.kernel = *kernel;
        filter.y.kernel.step = 1.0;
    } else {
        filter.x.kernel = *kernel;
        filter.x.kernel.step = kernel->step > 0.0 ? kernel->step : filter.x.step;
        filter.x.kind = kind;
    }
    return vkb_blur_row(levels, &filter, false, from, to);
}

void vkb_levels_blur(struct vkb_levels *levels, uint32_t level, uint32_t from,
                     const struct vkb_kernel *kernel, enum vkb_mode kind)
{
    const uint32_t between = vkb_levels_step(levels, levels->sizes[level], "down_%u_across", level);
    const struct vkb_pass_row rows =
        blur_row(levels, kernel, DIRECTION_HORIZONTAL, kind, from, between);
    vkb_levels_pass(levels, &rows);
    struct vkb_pass_row columns = blur_row(levels, kernel, DIRECTION_VERTICAL, UPSAMPLE_LINEAR,
                                           between, vkb_levels_down(levels, level));
    vkb_join(levels, &rows, &columns);
    vkb_levels_pass(levels, &columns);
}

// The filter by which UPSAMPLE_TENT and the others enlarge a smaller level, with the distances of
// the taps of a tent, or of its corners alone, in its texels.
static struct vkb_filter enlarging(const struct vkb_graph *graph, uint32_t from, uint32_t to,
                                   enum vkb_mode kernel, double radius_x, double radius_y,
                                   double gain)
{
    const struct vkb_kernel centre[][2] = {{vkb_centre(), vkb_centre()}};
    const struct vkb_kernel tent[][2] = {
        {vkb_sides(radius_x, 0.25, 0.5), vkb_sides(radius_y, 0.25, 0.5)}};
    const struct vkb_kernel corners[][2] = {
        {vkb_sides(radius_x, 0.5, 0.0), vkb_sides(radius_y, 0.5, 0.0)}};
    const struct vkb_kernel halves[][2] = {{vkb_sides(1.0, 1.0, 0.0), vkb_sides(1.0, 1.0, 0.0)}};
    struct vkb_filter filter;

    switch (kernel) {
    case UPSAMPLE_TENT:
        filter = vkb_make_filter(graph, from, to, tent, 1, gain);
        break;
    case UPSAMPLE_CORNERS:
        filter = vkb_make_filter(graph, from, to, corners, 1, gain);
        break;
    default:
        filter = vkb_make_filter(graph, from, to, kernel == UPSAMPLE_INSET_CUBIC ? halves : centre,
                                 1, gain);
        vkb_set_kind(&filter, kernel);
    }
    filter.enlarges = true;
    return filter;
}

// Upsamples the smaller level `from` to `to`, and adds the level `same_size`, if there is one.
static void add_up(struct vkb_levels *levels, const struct vkb_combination *combination,
                   enum vkb_mode kernel, uint32_t from, uint32_t to, uint32_t same_size,
                   double same_size_share, double coarse_share)
{
    const struct vkb_image_row *smaller = &levels->graph->images[from];
    const struct vkb_image_row *larger = &levels->graph->images[to];
    const double unit = combination->width_step ? smaller->width : 1;
    double x = combination->radius_x * unit, y = combination->radius_y * unit;

    if (combination->target_step) {
        x = (double)smaller->width / larger->width;
        y = (double)smaller->height / larger->height;
    }
    const struct vkb_filter filter = enlarging(levels->graph, from, to, kernel, x, y, coarse_share);
    vkb_add_mixed_filter_pass(levels, &filter, from, same_size, same_size_share, to);
}

// Adds up levels. In rgba8unorm, whose largest value is 1, each image holds its sum divided by the
// sum for a constant image of 1 (`flat`; negative shares count as positive), and the bloom is
// multiplied by this.
uint32_t vkb_levels_add_up(struct vkb_levels *levels, const struct vkb_combination *combination)
{
    const bool means = vkb_stores_means(levels->source->format);
    uint32_t top = levels->downs[levels->count - 1];

    levels->below = combination->smallest;
    for (uint32_t level = levels->count - 1; level-- > 0;) {
        const uint32_t from = top;
        const double same_size = combination->same_size[level],
                     coarse = combination->coarse[level] * levels->below;
        const double sum = fabs(same_size) + fabs(coarse), flat = means && sum > 0.0 ? sum : 1.0;
        top = vkb_levels_image(levels, levels->sizes[level], "up_%u", level);
        add_up(levels, combination, combination->kernel, from, top, levels->downs[level],
               same_size / flat, coarse / flat);
        levels->below = flat;
    }
    return top;
}

uint32_t vkb_levels_combine(struct vkb_levels *levels, const struct vkb_combination *combination)
{
    const uint32_t top = vkb_levels_add_up(levels, combination);
    const uint32_t bloom = vkb_levels_bloom(levels);

    add_up(levels, combination, combination->last_kernel, top, bloom, VKB_NO_IMAGE, 0.0,
           combination->gain * levels->below);
    return bloom;
}

static const struct vkb_combination alone = {0};

void vkb_levels_resize(struct vkb_levels *levels, uint32_t from, double gain, uint32_t to)
{
    add_up(levels, &alone, UPSAMPLE_LINEAR, from, to, VKB_NO_IMAGE, 0.0, gain);
}

uint32_t vkb_levels_enlarge(struct vkb_levels *levels, enum vkb_mode kernel, uint32_t from,
                            double gain)
{
    const uint32_t bloom = vkb_levels_bloom(levels);

    add_up(levels, &alone, kernel, from, bloom, VKB_NO_IMAGE, 0.0, gain);
    return bloom;
}

void vkb_levels_gather(struct vkb_levels *levels, const double *shares, enum vkb_mode kernel,
                       uint32_t to)
{
    struct vkb_pass_row row =
        vkb_fetching_row(levels, &vkb_shader_gather_frag, levels->downs[0], to);
    struct vkb_filter filters[GATHERED_LEVELS];

    row.constants.upsample = kernel;
    row.constants.levels = (int32_t)levels->count;
    row.constants.tap_count = row.constants.kernels = 1;
    row.constants.window = kernel == UPSAMPLE_CUBIC ? 4 : 2;
    for (uint32_t level = 0; level < GATHERED_LEVELS; ++level)
        vkb_read_at(&row, SLOT_LEVELS + level,
                    level < levels->count ? levels->downs[level] : VKB_NO_IMAGE);
    row.block = VKB_BLOCK_filter;
    VKB_SET_TARGET(&row, filter, &levels->graph->images[to]);
    for (uint32_t level = 0; level < levels->count; ++level) {
        filters[level] =
            enlarging(levels->graph, levels->downs[level], to, kernel, 1.0, 1.0, shares[level]);
        row.params.filter.shares[level / 4][level % 4] = (float)shares[level];
    }
    vkb_set_filters(levels, &row, filters, levels->count);
    vkb_levels_pass(levels, &row);
}
