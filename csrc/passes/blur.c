#include "passes/blur.h"

#include <math.h>

static bool is_integer(double number)
{
    return floor(number) == number;
}

// Distributes each tap to the texels on both sides of it, unless the result is longer than
// LINE_RADIUS.
static void move_to_texels(struct vkb_kernel *kernel)
{
    const double last = ceil((kernel->count - 1) * kernel->step);
    struct vkb_kernel moved = {.count = (uint32_t)last + 1, .step = 1.0};

    if (last > LINE_RADIUS)
        return;
    moved.weights[0] = kernel->weights[0];
    for (uint32_t tap = 1; tap < kernel->count; ++tap) {
        const double at = tap * kernel->step, part = at - floor(at);
        const int texel = (int)floor(at);
        // The taps on both sides contribute to the centre texel.
        moved.weights[texel] += (texel == 0 ? 2.0 : 1.0) * (1.0 - part) * kernel->weights[tap];
        if (part > 0.0)
            moved.weights[texel + 1] += part * kernel->weights[tap];
    }
    while (moved.count > 1 && moved.weights[moved.count - 1] == 0.0)
        --moved.count;
    *kernel = moved;
}

static bool keeps_size(const struct vkb_filter *filter)
{
    return filter->x.from == filter->x.to && filter->y.from == filter->y.to;
}

static bool is_on_texels(const struct vkb_filter *filter)
{
    return is_integer(filter->x.kernel.step) && is_integer(filter->y.kernel.step)
        && !filter->x.kernel.placed && !filter->y.kernel.placed
        && filter->x.kind == UPSAMPLE_LINEAR;
}

void vkb_fill_weights(const struct vkb_kernel *kernel, double gain, float (*weights)[4])
{
    for (uint32_t i = 0; i < kernel->count; ++i)
        weights[i / 4][i % 4] = (float)(gain * kernel->weights[i]);
}

static void keep_unmoved(struct vkb_levels *levels, struct vkb_axis *axis)
{
    const struct vkb_filter along = {.x = *axis};

    if (levels->failed)
        return;
    const struct vkb_filter *kept = vkb_graph_keep_filters(levels->graph, &along, 1, levels->error);
    axis->unmoved = kept ? &kept->x : NULL;
    levels->failed = !kept;
}

struct vkb_pass_row vkb_blur_row(struct vkb_levels *levels, const struct vkb_filter *given,
                                 bool sampled, uint32_t from, uint32_t to)
{
    const struct vkb_image_row *target = &levels->graph->images[to];
    struct vkb_pass_row row = vkb_fullscreen_row(target->name, &vkb_shader_blur_frag, to);
    struct vkb_filter_params *params = &row.params.filter;
    struct vkb_filter filter = *given;
    const enum vkb_mode direction = !filter.x.kernel.count ? DIRECTION_VERTICAL
                                  : !filter.y.kernel.count ? DIRECTION_HORIZONTAL
                                                           : DIRECTION_BOTH;
    const bool both = direction == DIRECTION_BOTH;
    struct vkb_kernel *kernel =
        direction == DIRECTION_VERTICAL ? &filter.y.kernel : &filter.x.kernel;

    if (!kernel->placed && filter.x.kind == UPSAMPLE_LINEAR && !both
        && (keeps_size(&filter) || is_integer(kernel->step))) {
        if (levels->graph->keeps_unmoved)
            keep_unmoved(levels, direction == DIRECTION_VERTICAL ? &filter.y : &filter.x);
        move_to_texels(kernel);
    }
    vkb_read_only(&row, from);
    row.block = VKB_BLOCK_filter;
    params->step_x = (float)filter.x.kernel.step;
    params->step_y = (float)filter.y.kernel.step;
    VKB_SET_TARGET(&row, filter, target);
    // Along one axis the gain is part of the weights, so that variants need not apply it.
    params->coarse = both ? (float)filter.gain : 1.0f;
    vkb_fill_weights(kernel, both ? 1.0 : filter.gain, params->weights);
    for (uint32_t i = 0; kernel->placed && i < kernel->count; ++i)
        params->offsets[i / 4][i % 4] = (float)kernel->offsets[i];
    row.constants.placed = kernel->placed;
    row.constants.direction = direction;
    if (filter.x.kind != UPSAMPLE_LINEAR)
        row.constants.upsample = filter.x.kind;
    row.constants.radius = (int32_t)kernel->count - 1;
    row.constants.sampling = keeps_size(&filter) && is_on_texels(&filter) ? SAMPLING_TEXEL
                           : sampled                                      ? SAMPLING_FILTER
                                                                          : SAMPLING_FETCH;
    vkb_set_filters(levels, &row, &filter, 1);
    return row;
}

const struct vkb_kernel *vkb_texel_kernel(const struct vkb_axis *axis, uint32_t limit)
{
    const struct vkb_kernel *kernel = &axis->kernel;

    return kernel->count && !kernel->placed && kernel->step == 1.0 && kernel->count - 1 <= limit
                && axis->kind == UPSAMPLE_LINEAR && !axis->slopes && axis->border == VKB_BORDER_NONE
             ? kernel
             : NULL;
}

const struct vkb_kernel *vkb_line_of(const struct vkb_pass_row *pass, enum vkb_mode direction,
                                     uint32_t limit)
{
    const struct vkb_filter *filter = pass->filters;

    if (pass->filter_count != 1 || pass->transposed || pass->geometry != VKB_GEOMETRY_FULLSCREEN)
        return NULL;
    if (direction == DIRECTION_VERTICAL)
        return filter->x.kernel.count ? NULL : vkb_texel_kernel(&filter->y, limit);
    return filter->y.kernel.count ? NULL : vkb_texel_kernel(&filter->x, limit);
}
