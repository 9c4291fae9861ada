// The adjoint of a convolution: the transpose by the same spectrum (methods/convolution.h). What
// its result has beyond edges that are repeated folds back to these.
#include "methods/adjoint.h"
#include "methods/convolution.h"
#include "methods/field.h"
#include "passes/adjoint.h"
#include "passes/levels.h"

// The kernel's spectrum, which the first product reads.
static uint32_t find_spectrum(const struct vkb_graph *graph)
{
    uint32_t pass = 0;

    while (graph->passes[pass].constants.stage != STAGE_PRODUCT
           && graph->passes[pass].constants.stage != STAGE_GREY)
        ++pass;
    return graph->passes[pass].reads[SLOT_SPECTRUM];
}

// Accumulates cotangents of what the filter of bright colours makes of the image. The result of the
// pass has its size, so that its cotangents, complete, are replaced by those for a moment.
static bool accumulate_bright(struct vkb_adjoint *adjoint, const struct vkb_pass_row *first,
                              const struct vkb_pass_row *pass, const struct vkb_filter *filter,
                              uint32_t convolved, struct vkb_error *error)
{
    struct vkb_pass_row row = vkb_slope_row(adjoint, pass, &vkb_shader_adjoint_bright_frag);
    uint32_t *cotangent = &adjoint->cotangents[pass->targets[0]];
    const uint32_t kept = *cotangent;

    *cotangent = VKB_NO_IMAGE;
    if (!vkb_accumulate_filter(adjoint, filter, convolved, pass->targets[0], error))
        return false;
    row.params = first->params;
    row.reads[SLOT_SOURCE] = first->reads[SLOT_SOURCE];
    row.reads[SLOT_COTANGENTS] = *cotangent;
    *cotangent = kept;
    return vkb_accumulate_cotangent(adjoint, &row, row.reads[SLOT_SOURCE], error);
}

bool vkb_transpose_convolution(struct vkb_adjoint *adjoint, const struct vkb_settings *settings,
                               const struct vkb_pass_row *pass, struct vkb_error *error)
{
    if (settings->field.count)
        return vkb_transpose_field(adjoint, settings, pass, error);
    struct vkb_graph *graph = adjoint->graph;
    const struct vkb_pass_row first_stage = vkb_find_transform(graph);
    const uint32_t glow = first_stage.reads[SLOT_SOURCE];
    const struct vkb_size size = vkb_size_of(graph, glow);
    struct vkb_convolution convolution = vkb_describe_convolution(settings, size);
    struct vkb_bloom_source source = {.buffers = size, .glow = vkb_cotangent_of(adjoint, pass)};
    const struct vkb_image_row result = {.name = "adjoint_convolved",
                                         .format = VKB_FORMAT_RGBA32_FLOAT};
    struct vkb_filter filter = {.kernels = 1, .gain = 1.0, .divisor = 1.0};
    struct vkb_levels levels = {
        .settings = settings, .source = &source, .graph = graph, .error = error};

    vkb_transpose_axes(&convolution);
    const uint32_t convolved =
        vkb_convolve_back(&levels, &convolution, find_spectrum(graph), &result);
    if (levels.failed)
        return false;
    vkb_axis_move(&filter.x, size.width, convolution.result.width, -(double)convolution.x.first);
    vkb_axis_move(&filter.y, size.height, convolution.result.height, -(double)convolution.y.first);
    if (!first_stage.constants.prefiltered)
        return vkb_accumulate_filter(adjoint, &filter, convolved, glow, error);
    return accumulate_bright(adjoint, &first_stage, pass, &filter, convolved, error);
}
