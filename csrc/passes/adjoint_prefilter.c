// The adjoints of passes that are no filters: at the pixels of the target the cotangents of each
// kernel, or of each tap, and from these those of the image by its linear filter.
#include "passes/adjoint.h"
#include "passes/prefilter.h"
#include "passes/tap_sets.h"

// The mean of as many texels for each pixel, from the first ones on, or from the last ones back.
static void set_block(struct vkb_axis *axis, int32_t count, bool backwards)
{
    axis->step = count;
    axis->origin = backwards ? axis->from - 1.0 - axis->step * (axis->to - 1.0) : 0.0;
    axis->count = 0;
    for (int32_t i = 0; i < count; ++i)
        axis->taps[axis->count++] =
            (struct vkb_tap){.offset = backwards ? -i : i, .weights = {1.0 / count}};
}

// The filter of a kernel or of a tap. `first` is the row at which its picture begins.
static void begin_filter(const struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                         uint32_t number, uint32_t first, struct vkb_filter *filter)
{
    const struct vkb_constants *constants = &pass->constants;
    const double step_x = pass->params.prefilter.step_x, step_y = pass->params.prefilter.step_y;

    vkb_filter_begin(adjoint->graph, pass->reads[SLOT_SOURCE], pass->targets[0], filter);
    filter->y.first = first;
    if (constants->mean_side) {
        set_block(&filter->x, constants->mean_side, false);
        set_block(&filter->y, constants->mean_side, true);
    } else {
        (vkb_differs_by_tap(pass) ? vkb_filter_tap : vkb_filter_kernel)(filter, constants->tap_set,
                                                                        number, step_x, step_y);
    }
}

// Those of a mean, which is a filter of the image.
static bool accumulate_mean(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                            const struct vkb_pass_row *row, struct vkb_error *error)
{
    const struct vkb_constants *constants = &pass->constants;
    const struct vkb_prefilter_params *params = &pass->params.prefilter;
    const uint32_t source = pass->reads[SLOT_SOURCE], target = pass->targets[0];
    struct vkb_filter filter;

    begin_filter(adjoint, pass, 0, 0, &filter);
    if (!constants->mean_side
        && !vkb_filter_mean(&filter, constants->tap_set, params->step_x, params->step_y))
        return vkb_fail(error, VKB_ERROR_GENERAL,
                        "%s: the mean of its taps has more than %d kernels, or more than %d taps "
                        "along an axis",
                        pass->name, MAX_KERNELS, VKB_MAX_TAPS);
    if (vkb_is_linear(pass))
        return vkb_accumulate_filter(adjoint, &filter, vkb_cotangent_of(adjoint, pass), source,
                                     error);
    return vkb_accumulate_through(adjoint, row, &filter, source, target, error);
}

// All kernels from one pass, below each other in one image.
static bool accumulate_stacked(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                               const struct vkb_pass_row *given, uint32_t count,
                               struct vkb_error *error)
{
    const struct vkb_image_row *target = &adjoint->graph->images[pass->targets[0]];
    const uint32_t height = target->height;
    const struct vkb_size size = {target->width, count * height};
    struct vkb_filter filters[MAX_SET_TAPS];
    struct vkb_pass_row row = *given;
    uint32_t image;

    row.constants.stacked_samples = (int32_t)count;
    if (!vkb_add_adjoint_image(adjoint, &row, size, &image, error))
        return false;
    for (uint32_t kernel = 0; kernel < count; ++kernel)
        begin_filter(adjoint, pass, kernel, kernel * height, &filters[kernel]);
    return vkb_accumulate_pictures(adjoint, filters, count, image, pass->reads[SLOT_SOURCE], error);
}

// Each kernel by a pass of its own: if there is one, or if an image of all would be too high.
static bool accumulate_each(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                            const struct vkb_pass_row *given, uint32_t count,
                            struct vkb_error *error)
{
    struct vkb_pass_row row = *given;
    struct vkb_filter filter;

    for (uint32_t kernel = 0; kernel < count; ++kernel) {
        row.constants.first_sample = (int32_t)kernel;
        begin_filter(adjoint, pass, kernel, 0, &filter);
        if (!vkb_accumulate_through(adjoint, &row, &filter, pass->reads[SLOT_SOURCE],
                                    pass->targets[0], error))
            return false;
    }
    return true;
}

bool vkb_transpose_prefilter(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                             struct vkb_error *error)
{
    const struct vkb_graph *graph = adjoint->graph;
    const int32_t set = pass->constants.tap_set;
    const uint32_t target = pass->targets[0], height = graph->images[target].height;

    if (vkb_is_line_set(set))
        return (pass->constants.before || pass->constants.after
                    ? vkb_transpose_nine
                    : vkb_transpose_filters)(adjoint, pass, error);
    const uint32_t count = vkb_differs_by_tap(pass) ? vkb_count_taps(set) : vkb_count_kernels(set);
    const bool stacked = count > 1 && (uint64_t)count * height <= adjoint->max_side;
    struct vkb_pass_row row = vkb_slope_row(adjoint, pass, &vkb_shader_adjoint_prefilter_frag);

    row.constants.stacked_samples = 1;
    // Its taps are texels then. The shader reads the mask in the same way.
    if (vkb_has_texel_places(set) && vkb_same_size(graph, row.reads[SLOT_SOURCE], target)
        && (!row.constants.masked || vkb_same_size(graph, row.reads[SLOT_MASK], target)))
        row.constants.sampling = SAMPLING_TEXEL;
    if (!vkb_add_threshold_sums(adjoint, pass, &row, &vkb_shader_adjoint_prefilter_sums_frag, error)
        || (adjoint->sums.colour && vkb_has_colour(pass)
            && !vkb_add_product_sums(adjoint, vkb_cotangent_of(adjoint, pass), target, ".by_colour",
                                     error)))
        return false;
    const bool done = vkb_is_mean(pass) ? accumulate_mean(adjoint, pass, &row, error)
                    : stacked           ? accumulate_stacked(adjoint, pass, &row, count, error)
                                        : accumulate_each(adjoint, pass, &row, count, error);
    return done && vkb_accumulate_mask(adjoint, pass, &row, error);
}
