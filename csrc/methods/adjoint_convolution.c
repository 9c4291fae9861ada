// The adjoint of a convolution: a convolution of the cotangents with the mirrored kernel. With a
// period, or zeros beyond the edges, it is one of the same size. Pixels beyond an edge that is
// repeated have cotangents of their own, so the result has these, too; then they fold back to the
// edge. With a mirror, whose kernels are symmetric, it is the convolution itself.
#include "methods/adjoint.h"
#include "passes/adjoint.h"
#include "passes/levels.h"

// The kernel with its centre at the same place: an even side becomes one longer.
static bool mirror_kernel(const struct vkb_kernel_data *kernel, struct vkb_graph *graph,
                          struct vkb_kernel_data *mirrored, struct vkb_error *error)
{
    const uint32_t x = kernel->width / 2, y = kernel->height / 2;
    const uint32_t width = 2 * x + 1, height = 2 * y + 1;
    float *pixels = vkb_alloc(error, (size_t)width * height, 4 * sizeof *pixels);

    if (!pixels)
        return false;
    for (uint32_t row = 0; row < height; ++row)
        for (uint32_t column = 0; column < width; ++column) {
            const uint32_t from_x = 2 * x - column, from_y = 2 * y - row;
            if (from_x >= kernel->width || from_y >= kernel->height)
                continue;
            for (int channel = 0; channel < 4; ++channel)
                pixels[4 * ((size_t)row * width + column) + channel] =
                    kernel->pixels[4 * ((size_t)from_y * kernel->width + from_x) + channel];
        }
    *mirrored = *kernel;
    mirrored->pixels = graph->owned[1] = pixels;
    mirrored->width = width;
    mirrored->height = height;
    mirrored->serial = kernel->serial ^ UINT64_C(0x9e3779b97f4a7c15);
    return true;
}

// The first stage of the transform, which reads what is convolved. A copy: adding passes moves
// those of the graph.
static struct vkb_pass_row find_first(const struct vkb_graph *graph)
{
    uint32_t pass = 0;

    while (!vkb_computes(&graph->passes[pass], VKB_BLOCK_fft)
           || graph->passes[pass].constants.stage != STAGE_FIRST)
        ++pass;
    return graph->passes[pass];
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
    struct vkb_graph *graph = adjoint->graph;
    const int boundary = settings->choices[VKB_CHOICE_boundary];
    const struct vkb_pass_row first_stage = find_first(graph);
    const uint32_t glow = first_stage.reads[SLOT_SOURCE], first = graph->pass_count;
    const struct vkb_size size = {graph->images[glow].width, graph->images[glow].height};
    struct vkb_settings mirrored = *settings;
    struct vkb_bloom_source source = {.buffers = size, .glow = vkb_cotangent_of(adjoint, pass)};
    const struct vkb_image_row result = {.name = "adjoint_convolved",
                                         .format = VKB_FORMAT_RGBA32_FLOAT};
    struct vkb_filter filter = {.kernels = 1, .gain = 1.0, .divisor = 1.0};
    struct vkb_levels levels = {
        .settings = &mirrored, .source = &source, .graph = graph, .error = error};

    if (boundary != BOUNDARY_MIRROR
        && !mirror_kernel(&settings->kernel, graph, &mirrored.kernel, error))
        return false;
    // The filter of bright colours comes before the convolution, after its transpose.
    mirrored.kernel.prefilter[0] = 1.0f;
    mirrored.kernel.prefilter[1] = 0.0f;
    const uint32_t convolved = vkb_convolve(&levels, &result, "adjoint_", true);
    if (levels.failed)
        return false;
    // The alpha is one of a cotangent, not 1.
    for (uint32_t i = first; i < graph->pass_count; ++i)
        graph->passes[i].constants.alpha = ALPHA_BLUR;
    // A mirrored kernel reaches as far on both sides.
    const struct vkb_image_row *whole = &graph->images[convolved];
    vkb_axis_move(&filter.x, size.width, whole->width, -0.5 * (whole->width - size.width));
    vkb_axis_move(&filter.y, size.height, whole->height, -0.5 * (whole->height - size.height));
    if (!first_stage.constants.prefiltered)
        return vkb_accumulate_filter(adjoint, &filter, convolved, glow, error);
    return accumulate_bright(adjoint, &first_stage, pass, &filter, convolved, error);
}
