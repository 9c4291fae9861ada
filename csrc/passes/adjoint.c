#include "passes/adjoint.h"

#include "passes/taps.h"

#include <stdio.h>
#include <string.h>

// A filter whose texels are read by no more pixels than this is one pass, not one for each axis.
static const double MAX_IN_ONE_PASS = 20.0;

uint32_t vkb_cotangent_of(const struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass)
{
    return adjoint->cotangents[pass->targets[0]];
}

// With a texel buffer for each slot, where the pass has linear texels.
_Static_assert((int)SLOT_DIFFERENTIATED < (int)VKB_MAX_LINEAR_TEXELS, "there is a slot too many");

struct vkb_pass_row vkb_adjoint_row(const struct vkb_shader *shader, uint32_t cotangents)
{
    struct vkb_pass_row row = vkb_fullscreen_row("", shader, VKB_NO_IMAGE);

    row.transposed = true;
    vkb_read_at(&row, SLOT_COTANGENTS, cotangents);
    vkb_read_at(&row, SLOT_DIFFERENTIATED, VKB_NO_IMAGE);
    return row;
}

struct vkb_pass_row vkb_slope_row(const struct vkb_adjoint *adjoint,
                                  const struct vkb_pass_row *pass, const struct vkb_shader *shader)
{
    struct vkb_pass_row row = vkb_adjoint_row(shader, vkb_cotangent_of(adjoint, pass));

    row.reads[SLOT_SOURCE] = pass->reads[SLOT_SOURCE];
    if (pass->constants.masked)
        row.reads[SLOT_MASK] = pass->reads[SLOT_MASK];
    row.constants = pass->constants;
    row.constants.dither = 0;
    row.block = pass->block;
    row.params = pass->params;
    return row;
}

static bool add_numbered_pass(struct vkb_adjoint *adjoint, const char *prefix, uint32_t number,
                              struct vkb_pass_row *row, struct vkb_size size, uint32_t *image,
                              struct vkb_error *error)
{
    char name[VKB_NAME_SIZE];

    snprintf(name, sizeof name, "%s_%u", prefix, number);
    if (!vkb_add_target_image(adjoint->graph, name, VKB_FORMAT_RGBA32_FLOAT, size, false, image,
                              error))
        return false;
    vkb_set_name(row->name, sizeof row->name, name);
    row->targets[0] = *image;
    return vkb_graph_add_pass(adjoint->graph, row, error);
}

bool vkb_add_adjoint_pass(struct vkb_adjoint *adjoint, struct vkb_pass_row *row,
                          struct vkb_size size, uint32_t *image, struct vkb_error *error)
{
    return adjoint->of_sums
             ? add_numbered_pass(adjoint, "adjoint_of_sum", adjoint->between++, row, size, image,
                                 error)
             : add_numbered_pass(adjoint, "adjoint", adjoint->added++, row, size, image, error);
}

void vkb_delay_scene(struct vkb_adjoint *adjoint, const struct vkb_pass_row *row,
                     struct vkb_share share, uint32_t image)
{
    adjoint->scene = image;
    adjoint->share = share;
    adjoint->scene_row = *row;
    adjoint->cotangents[image] = row->reads[SLOT_COTANGENTS];
}

bool vkb_end_scene(struct vkb_adjoint *adjoint, struct vkb_error *error)
{
    const uint32_t image = adjoint->scene;

    if (image == VKB_NO_IMAGE)
        return true;
    adjoint->scene = VKB_NO_IMAGE;
    adjoint->cotangents[image] = VKB_NO_IMAGE;
    return vkb_accumulate_cotangent(adjoint, &adjoint->scene_row, image, error);
}

// Has the row add what the composite has left to the next pass. Only filters have a share for it,
// and only other passes leave out what is not positive.
static bool take_scene(struct vkb_adjoint *adjoint, struct vkb_pass_row *row,
                       struct vkb_error *error)
{
    const struct vkb_share share = adjoint->share;

    if (row->block == VKB_BLOCK_adjoint_filter && !share.of_positive) {
        row->params.adjoint_filter.share = (float)share.factor;
        row->params.adjoint_filter.share_of_mask = (float)share.by_mask;
        row->constants.masked = adjoint->scene_row.constants.masked;
        row->reads[SLOT_MASK] = adjoint->scene_row.reads[SLOT_MASK];
    } else if (row->block == VKB_BLOCK_adjoint_filter || share.factor != 1.0
               || adjoint->scene_row.constants.masked) {
        return vkb_end_scene(adjoint, error);
    }
    row->constants.of_positive = share.of_positive;
    adjoint->scene = VKB_NO_IMAGE;
    return true;
}

bool vkb_accumulate_cotangent(struct vkb_adjoint *adjoint, const struct vkb_pass_row *given,
                              uint32_t place, struct vkb_error *error)
{
    const uint32_t image = place == adjoint->glow ? adjoint->image : place;
    struct vkb_pass_row row = *given;
    uint32_t *cotangent = &adjoint->cotangents[image];

    if (image == adjoint->scene && !take_scene(adjoint, &row, error))
        return false;
    const struct vkb_image_row *forward = &adjoint->graph->images[image];
    const struct vkb_size size = vkb_size_of(adjoint->graph, image);
    row.constants.adds_image = *cotangent != VKB_NO_IMAGE;
    row.reads[SLOT_ADDED] = *cotangent;
    row.constants.of_source = vkb_is_of_source(forward);
    if (row.constants.of_source)
        row.reads[SLOT_DIFFERENTIATED] = image;
    return vkb_add_adjoint_pass(adjoint, &row, size, cotangent, error);
}

bool vkb_add_adjoint_image(struct vkb_adjoint *adjoint, const struct vkb_pass_row *given,
                           struct vkb_size size, uint32_t *image, struct vkb_error *error)
{
    struct vkb_pass_row row = *given;

    return vkb_add_adjoint_pass(adjoint, &row, size, image, error);
}

// A copy of the filter for rows of its transpose along one axis, or both, whose weights are in the
// table; NULL on failure.
static const struct vkb_filter *add_weights(struct vkb_adjoint *adjoint,
                                            const struct vkb_filter *given, enum vkb_mode direction,
                                            struct vkb_error *error)
{
    struct vkb_filter filter = *given;

    filter.x.readers = vkb_kept_readers;
    filter.y.readers = vkb_kept_readers;
    return (direction == DIRECTION_VERTICAL
            || vkb_axis_transpose(&filter.x, filter.kernels, &adjoint->table, error))
                && (direction == DIRECTION_HORIZONTAL
                    || vkb_axis_transpose(&filter.y, filter.kernels, &adjoint->table, error))
             ? vkb_graph_keep_filters(adjoint->graph, &filter, 1, error)
             : NULL;
}

// The row of the transpose along one axis, or both, of a filter by add_weights().
static struct vkb_pass_row filter_row(const struct vkb_adjoint *adjoint,
                                      const struct vkb_filter *filter, enum vkb_mode direction,
                                      uint32_t cotangents)
{
    struct vkb_pass_row row = vkb_adjoint_row(&vkb_shader_adjoint_filter_frag, cotangents);
    struct vkb_adjoint_filter_params *params = &row.params.adjoint_filter;

    row.reads[SLOT_WEIGHTS] = adjoint->table_image;
    row.constants.direction = direction;
    row.constants.kernels = (int32_t)filter->kernels;
    row.block = VKB_BLOCK_adjoint_filter;
    row.filters = filter;
    row.filter_count = 1;
    params->gain = (float)(filter->gain / filter->divisor);
    params->share = 1.0f;
    if (direction != DIRECTION_VERTICAL)
        params->start_x = filter->x.readers.start;
    if (direction != DIRECTION_HORIZONTAL)
        params->start_y = filter->y.readers.start;
    return row;
}

static bool accumulate_along(struct vkb_adjoint *adjoint, const struct vkb_filter *filter,
                             enum vkb_mode direction, uint32_t cotangents, uint32_t image,
                             struct vkb_error *error)
{
    const struct vkb_filter *weighted = add_weights(adjoint, filter, direction, error);

    if (!weighted)
        return false;
    const struct vkb_pass_row row = filter_row(adjoint, weighted, direction, cotangents);
    return vkb_accumulate_cotangent(adjoint, &row, image, error);
}

// Along one axis to an image between, then along the other one.
static bool accumulate_twice(struct vkb_adjoint *adjoint, const struct vkb_filter *given,
                             uint32_t cotangents, uint32_t image, struct vkb_error *error)
{
    const struct vkb_filter *filter = add_weights(adjoint, given, DIRECTION_BOTH, error);
    const struct vkb_axis *x = &given->x, *y = &given->y;
    // Only the table of columns knows where the first row is.
    const bool rows = y->first == 0 && (uint64_t)x->from * y->to < (uint64_t)x->to * y->from;
    const struct vkb_size size = {rows ? x->from : x->to, rows ? y->to : y->from};
    uint32_t between;

    if (!filter)
        return false;
    struct vkb_pass_row row =
        filter_row(adjoint, filter, rows ? DIRECTION_HORIZONTAL : DIRECTION_VERTICAL, cotangents);
    row.params.adjoint_filter.gain = 1.0f;
    if (!vkb_add_adjoint_image(adjoint, &row, size, &between, error))
        return false;
    row = filter_row(adjoint, filter, rows ? DIRECTION_VERTICAL : DIRECTION_HORIZONTAL, between);
    row.joined = filter;
    row.joined_from = cotangents;
    row.joined_count = 1;
    return vkb_accumulate_cotangent(adjoint, &row, image, error);
}

// Whether the filter leaves the cotangents as they are, and nothing is added to them.
static bool keeps_cotangents(const struct vkb_adjoint *adjoint, const struct vkb_filter *filter,
                             uint32_t image)
{
    return filter->kernels == 1 && filter->gain == filter->divisor
        && vkb_axis_is_identity(&filter->x) && vkb_axis_is_identity(&filter->y)
        && adjoint->cotangents[image] == VKB_NO_IMAGE && image != adjoint->glow
        && !vkb_is_given(&adjoint->graph->images[image]);
}

// A filter whose texels many pixels read, for each of its kernels by itself: along one axis, then
// along the other one.
static bool accumulate_kernels(struct vkb_adjoint *adjoint, const struct vkb_filter *filter,
                               uint32_t cotangents, uint32_t image, struct vkb_error *error)
{
    for (uint32_t kernel = 0; kernel < filter->kernels; ++kernel) {
        struct vkb_filter own = *filter;
        own.kernels = 1;
        vkb_axis_take(&own.x, kernel);
        vkb_axis_take(&own.y, kernel);
        if (!vkb_accumulate_filter(adjoint, &own, cotangents, image, error))
            return false;
    }
    return true;
}

// The axes that a filter does not leave as they are.
static enum vkb_mode direction_of(const struct vkb_filter *filter)
{
    return filter->kernels > 1              ? DIRECTION_BOTH
         : vkb_axis_is_identity(&filter->y) ? DIRECTION_HORIZONTAL
         : vkb_axis_is_identity(&filter->x) ? DIRECTION_VERTICAL
                                            : DIRECTION_BOTH;
}

// Whether the filter is one row.
static bool is_one_row(const struct vkb_filter *filter)
{
    return direction_of(filter) != DIRECTION_BOTH
        || vkb_axis_readers(&filter->x) * vkb_axis_readers(&filter->y) <= MAX_IN_ONE_PASS;
}

bool vkb_accumulate_filter(struct vkb_adjoint *adjoint, const struct vkb_filter *filter,
                           uint32_t cotangents, uint32_t image, struct vkb_error *error)
{
    if (keeps_cotangents(adjoint, filter, image)) {
        adjoint->cotangents[image] = cotangents;
        return true;
    }
    const enum vkb_mode direction = direction_of(filter);
    const bool reads_many = !is_one_row(filter);

    if (reads_many && filter->kernels == 1)
        return accumulate_twice(adjoint, filter, cotangents, image, error);
    // Those of an image that is enlarged are read together.
    if (reads_many && filter->x.step >= 1.0 && filter->y.step >= 1.0)
        return accumulate_kernels(adjoint, filter, cotangents, image, error);
    return accumulate_along(adjoint, filter, direction, cotangents, image, error);
}

bool vkb_accumulate_pictures(struct vkb_adjoint *adjoint, const struct vkb_filter *filters,
                             uint32_t count, uint32_t cotangents, uint32_t image,
                             struct vkb_error *error)
{
    const struct vkb_graph *graph = adjoint->graph;
    struct vkb_filter joined[MAX_PICTURES];
    uint32_t rows = 0;
    bool joins = true;

    for (uint32_t i = 0; i < count; ++i) {
        const uint32_t before = graph->pass_count;
        if (!vkb_accumulate_filter(adjoint, &filters[i], cotangents, image, error))
            return false;
        joins = joins && i < MAX_PICTURES && is_one_row(&filters[i]) && filters[i].kernels == 1
             && filters[i].gain == filters[0].gain;
        // The first one may leave the cotangents as they are.
        if (joins && graph->pass_count > before)
            joined[rows++] = *graph->passes[graph->pass_count - 1].filters;
    }
    if (!joins || rows < 2)
        return true;
    struct vkb_pass_row *last = &graph->passes[graph->pass_count - 1];
    last->joined = vkb_graph_keep_filters(adjoint->graph, joined, rows, error);
    last->joined_from = cotangents;
    last->joined_count = rows;
    return last->joined != NULL;
}

bool vkb_filter_to_image(struct vkb_adjoint *adjoint, const struct vkb_filter *filter,
                         uint32_t cotangents, struct vkb_size size, uint32_t *image,
                         struct vkb_error *error)
{
    const enum vkb_mode direction = direction_of(filter);
    const struct vkb_filter *weighted = add_weights(adjoint, filter, direction, error);

    if (!weighted)
        return false;
    const struct vkb_pass_row row = filter_row(adjoint, weighted, direction, cotangents);
    return vkb_add_adjoint_image(adjoint, &row, size, image, error);
}

bool vkb_accumulate_through(struct vkb_adjoint *adjoint, const struct vkb_pass_row *row,
                            const struct vkb_filter *filter, uint32_t image, uint32_t target,
                            struct vkb_error *error)
{
    const uint32_t kept = adjoint->cotangents[target];

    if (vkb_axis_is_identity(&filter->x) && vkb_axis_is_identity(&filter->y))
        return vkb_accumulate_cotangent(adjoint, row, image, error);
    // The cotangents of the target, complete, are replaced for a moment by those of what it
    // samples.
    adjoint->cotangents[target] = VKB_NO_IMAGE;
    const bool done =
        vkb_accumulate_cotangent(adjoint, row, target, error)
        && vkb_accumulate_filter(adjoint, filter, adjoint->cotangents[target], image, error);
    adjoint->cotangents[target] = kept;
    return done;
}

bool vkb_accumulate_sampled(struct vkb_adjoint *adjoint, const struct vkb_pass_row *row,
                            uint32_t image, uint32_t target, struct vkb_error *error)
{
    struct vkb_filter filter;

    vkb_filter_begin(adjoint->graph, image, target, &filter);
    return vkb_accumulate_through(adjoint, row, &filter, image, target, error);
}

bool vkb_accumulate_mask(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                         struct vkb_pass_row *row, struct vkb_error *error)
{
    row->constants.by = BY_MASK;
    return !pass->constants.masked
        || vkb_accumulate_sampled(adjoint, row, pass->reads[SLOT_MASK], pass->targets[0], error);
}

_Static_assert(SUM_SIDE % PIXEL_INVOCATIONS == 0, "a workgroup has whole blocks");

// Adds a pass of lib/sums.glsl over a picture, whose size becomes that of the sums.
static bool add_sum_pass(struct vkb_adjoint *adjoint, struct vkb_pass_row *row,
                         struct vkb_size *size, uint32_t *image, struct vkb_error *error)
{
    size->width = (size->width + SUM_SIDE - 1) / SUM_SIDE;
    size->height = (size->height + SUM_SIDE - 1) / SUM_SIDE;
    // The squares are below the sums.
    const struct vkb_size both = {size->width, 2 * size->height};
    return add_numbered_pass(adjoint, "adjoint_sum", adjoint->summed++, row, both, image, error);
}

bool vkb_add_sum_passes(struct vkb_adjoint *adjoint, const struct vkb_pass_row *given,
                        const struct vkb_shader *shader, struct vkb_size size, const char *name,
                        struct vkb_error *error)
{
    struct vkb_pass_row row = *given;
    uint32_t image;

    row.shader = shader;
    row.constants.by = BY_VALUES;
    if (!add_sum_pass(adjoint, &row, &size, &image, error))
        return false;
    while (size.width > 1 || size.height > 1) {
        row = vkb_fullscreen_row("", &vkb_shader_adjoint_sum_frag, VKB_NO_IMAGE);
        row.constants.by = BY_VALUES;
        row.transposed = true;
        vkb_read_only(&row, image);
        if (!add_sum_pass(adjoint, &row, &size, &image, error))
            return false;
    }
    return vkb_graph_show_image(adjoint->graph, image, name, error);
}

bool vkb_add_product_sums(struct vkb_adjoint *adjoint, uint32_t cotangents, uint32_t image,
                          const char *name, struct vkb_error *error)
{
    struct vkb_pass_row row = vkb_adjoint_row(&vkb_shader_adjoint_products_frag, cotangents);

    row.constants.alpha = adjoint->alpha;
    row.reads[SLOT_SOURCE] = image;
    return vkb_add_sum_passes(adjoint, &row, row.shader, vkb_size_of(adjoint->graph, image), name,
                              error);
}

bool vkb_add_threshold_sums(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                            const struct vkb_pass_row *row, const struct vkb_shader *shader,
                            struct vkb_error *error)
{
    const struct vkb_size size = vkb_size_of(adjoint->graph, pass->targets[0]);
    bool has_slopes = false;

#define VKB_HAS_SLOPES(name, value, function) \
    has_slopes = has_slopes || pass->constants.after == name;
    THRESHOLD_POINTS(VKB_HAS_SLOPES)
#undef VKB_HAS_SLOPES
    return !adjoint->sums.threshold || !pass->constants.thresholded || !has_slopes
        || vkb_add_sum_passes(adjoint, row, shader, size, ".by_own_threshold", error);
}
