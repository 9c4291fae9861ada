// A convolution by Fourier transforms: the glow along its rows, then along its columns, times the
// kernel's spectrum, and the way back along columns and rows. The kernel's spectrum is an image of
// its own.
//
// Along an axis the glow has `extent` pixels, and of the kernel count the offsets from -before to
// after: what reaches farther falls outside everywhere (zero), is added to the last offset (edge),
// or to the one a period away (wrap). Zeros around the kernel do not count. Transforms are
// periodic, so that the lines are padded by as much as the kernel reaches: on both sides for an
// edge or a mirror, whose pixels lie there; on the longer side for zeros, which both sides share;
// not at all for a period that a transform can have.
//
// The transpose is the product with the conjugate spectrum, in lines of the same lengths, so that
// the kernel's spectrum is there once. What the lines read beyond the edges is transposed, too:
// with a period and a mirror it is the same, with the reaches exchanged. Texels beyond an edge that
// is repeated have cotangents of their own, so the result has these, too, and the lines begin with
// as many zeros.
#include "methods/convolution.h"

#include <stdio.h>

bool vkb_conjugates(const struct vkb_convolving *passes)
{
    // A mirror's kernel is symmetric, as in transpose_axis().
    return passes->transposed && passes->convolution->x.boundary != BOUNDARY_MIRROR;
}

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

static struct vkb_fft_axis make_axis(enum vkb_mode direction, enum vkb_boundary boundary,
                                     uint32_t extent, uint32_t furthest, struct vkb_reach *reach)
{
    const uint32_t centre = reach->kernel / 2;
    struct vkb_fft_axis axis = {.direction = direction, .boundary = boundary, .extent = extent};

    reach->first = centre - least(centre, furthest);
    reach->last = centre + least(reach->kernel - 1 - centre, furthest);
    reach->before = least(centre - reach->first, boundary == BOUNDARY_MIRROR ? extent : extent - 1);
    reach->after = least(reach->last - centre, extent - 1);
    uint32_t padding = reach->before + reach->after;
    if (boundary == BOUNDARY_WRAP && reach->last - reach->first >= extent - 1) {
        reach->before = extent / 2;
        reach->after = extent - 1 - extent / 2;
        padding = extent - 1;
    }
    if (boundary == BOUNDARY_WRAP && vkb_fft_line(extent).length == extent)
        padding = 0;
    if (boundary == BOUNDARY_ZERO)
        padding = reach->before > reach->after ? reach->before : reach->after;
    axis.before = reach->before;
    axis.line = vkb_fft_line(extent + padding);
    return axis;
}

struct vkb_convolution vkb_describe_convolution(const struct vkb_settings *settings,
                                                struct vkb_size size)
{
    const enum vkb_boundary boundary = (enum vkb_boundary)settings->choices[VKB_CHOICE_boundary];
    const bool wrap_x = boundary == BOUNDARY_WRAP_X;
    struct vkb_convolution convolution = {
        .result = size,
        .reach_x.kernel = settings->kernel.width,
        .reach_y.kernel = settings->kernel.height,
    };

    convolution.x = make_axis(DIRECTION_HORIZONTAL, wrap_x ? BOUNDARY_WRAP : boundary, size.width,
                              settings->kernel.reach_x, &convolution.reach_x);
    convolution.y = make_axis(DIRECTION_VERTICAL, wrap_x ? BOUNDARY_EDGE : boundary, size.height,
                              settings->kernel.reach_y, &convolution.reach_y);
    convolution.pads_rows = convolution.x.line.length > convolution.x.extent;
    convolution.pads_columns = convolution.y.line.length > convolution.y.extent;
    return convolution;
}

static void transpose_axis(struct vkb_fft_axis *axis, const struct vkb_reach *reach, uint32_t *side)
{
    // Kernels of a mirror are symmetric.
    if (axis->boundary == BOUNDARY_MIRROR)
        return;
    axis->before = reach->after;
    if (axis->boundary == BOUNDARY_EDGE) {
        axis->first = reach->after;
        *side += reach->before + reach->after;
        axis->boundary = BOUNDARY_ZERO;
    }
}

void vkb_transpose_axes(struct vkb_convolution *convolution)
{
    transpose_axis(&convolution->x, &convolution->reach_x, &convolution->result.width);
    transpose_axis(&convolution->y, &convolution->reach_y, &convolution->result.height);
}

uint32_t vkb_add_spectrum(const struct vkb_convolving *passes, const char *name,
                          struct vkb_size size)
{
    char named[VKB_NAME_SIZE];

    snprintf(named, sizeof named, "%s%s%s", passes->prefix, name, passes->suffix);
    return vkb_levels_target(passes->levels, named, VKB_FORMAT_RGBA32_FLOAT, size, false);
}

struct vkb_transform vkb_transform_of(const struct vkb_convolving *passes, uint32_t stages)
{
    const struct vkb_convolution *convolution = passes->convolution;
    const bool blurs_alpha = passes->levels->settings->choices[VKB_CHOICE_alpha] == ALPHA_BLUR;

    return (struct vkb_transform){
        .width = convolution->x.line.length,
        .height = convolution->y.line.length,
        .pads_rows = convolution->pads_rows,
        .pads_columns = convolution->pads_columns,
        .stages = stages,
        .channels = blurs_alpha ? 4 : 3,
    };
}

// That of the kernel's own passes.
static struct vkb_transform kernel_transform_of(const struct vkb_convolving *passes,
                                                uint32_t stages)
{
    struct vkb_transform transform = vkb_transform_of(passes, stages);

    if (passes->levels->settings->kernel.grey)
        transform.channels = 1;
    return transform;
}

// The pass that puts the kernel to its places in the padded lines.
static void add_placing(const struct vkb_convolving *passes, uint32_t kernel, uint32_t spectrum)
{
    const struct vkb_convolution *convolution = passes->convolution;
    const struct vkb_fft_axis *x = &convolution->x, *y = &convolution->y;
    struct vkb_pass_row row = vkb_fullscreen_row("kernel", &vkb_shader_fft_kernel_comp, spectrum);
    struct vkb_fft_kernel_params *params = &row.params.fft_kernel;

    row.geometry = VKB_GEOMETRY_DISPATCH;
    row.vertex = NULL;
    row.variant = "dispatch";
    row.block_width = row.block_height = PIXEL_INVOCATIONS;
    vkb_read_only(&row, kernel);
    row.block = VKB_BLOCK_fft_kernel;
    row.transform = kernel_transform_of(passes, 0);
    *params = (struct vkb_fft_kernel_params){
        .padded_x = (int)x->line.length,
        .boundary_x = x->boundary,
        .extent_x = (int)convolution->reach_x.kernel,
        .first_x = (int)convolution->reach_x.first,
        .last_x = (int)convolution->reach_x.last,
        .period_x = (int)x->extent,
        .before_x = (int)convolution->reach_x.before,
        .after_x = (int)convolution->reach_x.after,
        .padded_y = (int)y->line.length,
        .boundary_y = y->boundary,
        .extent_y = (int)convolution->reach_y.kernel,
        .first_y = (int)convolution->reach_y.first,
        .last_y = (int)convolution->reach_y.last,
        .period_y = (int)y->extent,
        .before_y = (int)convolution->reach_y.before,
        .after_y = (int)convolution->reach_y.after,
        .grey = passes->levels->settings->kernel.grey,
        // That of the way back.
        .gain = (float)(1.0 / ((double)x->line.length * y->line.length)),
    };
    vkb_levels_pass(passes->levels, &row);
}

// The row of a stage, of `stages` that follow each other from this one on; 0: from one before.
static struct vkb_pass_row stage_row(const struct vkb_convolving *passes,
                                     const struct vkb_fft_stage *stage, uint32_t stages)
{
    struct vkb_pass_row row = vkb_fft_row(passes->levels->graph, stage);

    row.transform = vkb_transform_of(passes, stages);
    // The alpha is one of a cotangent, not 1.
    if (passes->transposed)
        row.constants.alpha = ALPHA_BLUR;
    return row;
}

// Makes a stage multiply by weights and, on the way back, add an image.
static void set_weighing(const struct vkb_convolving *passes, const struct vkb_weighing *weighing,
                         struct vkb_pass_row *row)
{
    row->reads[SLOT_WEIGHTS] = weighing->weights;
    row->reads[SLOT_ADDED] = weighing->added;
    row->constants.weighted = weighing->weights != VKB_NO_IMAGE;
    row->constants.adds_image = weighing->added != VKB_NO_IMAGE;
    row->params.fft.weight = (int)weighing->channel;
    row->params.fft.share = 1.0f;
    row->params.fft.before_x = (int)passes->convolution->x.first;
    row->params.fft.before_y = (int)passes->convolution->y.first;
}

// The kernel's spectrum, in place.
static void add_kernel_stages(const struct vkb_convolving *passes, uint32_t spectrum)
{
    const struct vkb_fft_axis *axes[] = {&passes->convolution->x, &passes->convolution->y};

    for (int i = 0; i < 2; ++i) {
        struct vkb_fft_stage stage = {
            .name = "kernel",
            .axis = axes[i],
            .lines = axes[1 - i]->line.length,
            .from = spectrum,
            .to = spectrum,
        };
        // The first columns have the glow's pipeline, though none of their elements is padding.
        stage.padded = i == 1 && axes[i]->line.length > axes[i]->extent;
        const uint32_t count = axes[i]->line.stage_count;
        for (; stage.number < count; ++stage.number) {
            const uint32_t stages = stage.number == 0 ? count : 0;
            struct vkb_pass_row row = stage_row(passes, &stage, stages);
            row.params.fft.extent = INT32_MAX;
            row.transform = kernel_transform_of(passes, stages);
            vkb_levels_pass(passes->levels, &row);
            stage.padded = false;
        }
    }
}

uint32_t vkb_add_kernel_spectrum(const struct vkb_convolving *passes, uint32_t kernel)
{
    const uint32_t spectrum =
        vkb_add_spectrum(passes, "kernel_spectrum", vkb_padded_size(passes->convolution));

    add_placing(passes, kernel, spectrum);
    add_kernel_stages(passes, spectrum);
    return spectrum;
}

// The glow's transform along its rows.
static void add_rows(const struct vkb_convolving *passes, uint32_t from,
                     const struct vkb_weighing *weighing, uint32_t rows)
{
    const struct vkb_convolution *convolution = passes->convolution;
    const float *prefilter = passes->levels->settings->kernel.prefilter;
    struct vkb_fft_stage stage = {
        .name = "spectrum",
        .axis = &convolution->x,
        .lines = convolution->y.extent,
        .padded = convolution->x.line.length > convolution->x.extent,
        .from = from,
        .to = rows,
    };
    const uint32_t count = stage.axis->line.stage_count;

    for (; stage.number < count; ++stage.number) {
        struct vkb_pass_row row = stage_row(passes, &stage, stage.number == 0 ? count : 0);
        if (stage.number == 0) {
            row.constants.stage = STAGE_FIRST;
            set_weighing(passes, weighing, &row);
        }
        // Cotangents pass the filter of bright colours after the transpose.
        if (stage.number == 0 && !passes->transposed) {
            row.constants.prefiltered = prefilter[1] >= prefilter[0];
            row.params.fft.prefilter_min = prefilter[0];
            row.params.fft.prefilter_max = prefilter[1];
            row.params.fft.prefilter_factor = prefilter[2];
        }
        vkb_levels_pass(passes->levels, &row);
        stage.padded = false;
        stage.from = rows;
    }
}

// Along the columns forth; if there is a kernel's spectrum, with the product and the first stage
// back.
static void add_columns(const struct vkb_convolving *passes, uint32_t rows,
                        const struct vkb_weighing *weighing, uint32_t spectrum, uint32_t columns)
{
    const struct vkb_convolution *convolution = passes->convolution;
    const uint32_t last = convolution->y.line.stage_count - 1;
    const bool multiplies = spectrum != VKB_NO_IMAGE;
    struct vkb_fft_stage stage = {
        .name = multiplies ? "bloom" : "spectrum",
        .axis = &convolution->y,
        .lines = convolution->x.line.length,
        .padded = convolution->y.line.length > convolution->y.extent,
        .from = rows,
        .to = columns,
    };

    for (; stage.number <= last; ++stage.number) {
        const uint32_t stages = multiplies ? 2 * last + 1 : last + 1;
        struct vkb_pass_row row = stage_row(passes, &stage, stage.number == 0 ? stages : 0);
        if (stage.number == 0)
            set_weighing(passes, weighing, &row);
        if (multiplies && stage.number == last)
            vkb_fft_multiply(&convolution->x, &convolution->y, spectrum,
                             passes->levels->settings->kernel.grey, vkb_conjugates(passes), &row);
        vkb_levels_pass(passes->levels, &row);
        stage.padded = false;
        stage.from = columns;
    }
}

// Along the columns back. In place: without the first stage, which was part of the product; else
// with the product with a kernel's spectrum, if there is one.
static void add_columns_back(const struct vkb_convolving *passes, uint32_t from, uint32_t spectrum,
                             const struct vkb_weighing *weighing, uint32_t columns)
{
    const struct vkb_convolution *convolution = passes->convolution;
    const uint32_t count = convolution->y.line.stage_count;
    const bool multiplied = from == columns;
    struct vkb_fft_stage stage = {
        .name = "bloom",
        .axis = &convolution->y,
        .lines = convolution->x.line.length,
        .inverse = true,
        .from = from,
        .to = columns,
    };

    for (stage.number = multiplied ? count - 1 : count; stage.number-- > 0;) {
        const bool first = !multiplied && stage.number == count - 1;
        struct vkb_pass_row row = stage_row(passes, &stage, first ? count : 0);
        if (first && spectrum != VKB_NO_IMAGE)
            vkb_fft_multiply(&convolution->x, &convolution->y, spectrum, true,
                             vkb_conjugates(passes), &row);
        if (stage.number == 0) {
            // The rows back need no other.
            row.params.fft.kept = (int)convolution->result.height;
            set_weighing(passes, weighing, &row);
        }
        vkb_levels_pass(passes->levels, &row);
        stage.from = columns;
    }
}

static void add_rows_back(const struct vkb_convolving *passes, uint32_t columns,
                          const struct vkb_weighing *weighing, uint32_t target)
{
    const struct vkb_convolution *convolution = passes->convolution;
    struct vkb_fft_stage stage = {
        .name = "bloom",
        .axis = &convolution->x,
        .lines = convolution->result.height,
        .inverse = true,
        .from = columns,
    };
    const uint32_t count = stage.axis->line.stage_count;

    for (stage.number = count; stage.number-- > 0;) {
        stage.to = stage.number ? columns : target;
        struct vkb_pass_row row = stage_row(passes, &stage, stage.number == count - 1 ? count : 0);
        if (stage.number == 0) {
            row.constants.stage = STAGE_LAST;
            set_weighing(passes, weighing, &row);
        }
        vkb_levels_pass(passes->levels, &row);
    }
}

struct vkb_size vkb_padded_size(const struct vkb_convolution *convolution)
{
    return (struct vkb_size){convolution->x.line.length, convolution->y.line.length};
}

uint32_t vkb_add_rows(const struct vkb_convolving *passes, uint32_t from,
                      const struct vkb_weighing *weighing)
{
    // Variants transform the columns in place, whose result may be longer.
    const struct vkb_size lines = {passes->convolution->x.line.length,
                                   passes->convolution->result.height};
    const uint32_t rows = vkb_add_spectrum(passes, "rows_spectrum", lines);

    add_rows(passes, from, weighing, rows);
    return rows;
}

static uint32_t add_result(const struct vkb_convolving *passes, const struct vkb_image_row *result)
{
    return vkb_levels_target(passes->levels, result->name, result->format,
                             passes->convolution->result, result->framebuffer);
}

uint32_t vkb_add_columns(const struct vkb_convolving *passes, uint32_t rows,
                         const struct vkb_weighing *weighing)
{
    const uint32_t columns =
        vkb_add_spectrum(passes, "spectrum", vkb_padded_size(passes->convolution));

    add_columns(passes, rows, weighing, VKB_NO_IMAGE, columns);
    return columns;
}

uint32_t vkb_add_columns_back(const struct vkb_convolving *passes, uint32_t spectrum,
                              uint32_t kernel, const struct vkb_weighing *weighing)
{
    const uint32_t columns =
        vkb_add_spectrum(passes, "columns", vkb_padded_size(passes->convolution));

    add_columns_back(passes, spectrum, kernel, weighing, columns);
    return columns;
}

uint32_t vkb_add_rows_back(const struct vkb_convolving *passes, uint32_t columns,
                           const struct vkb_weighing *weighing, const struct vkb_image_row *result)
{
    const uint32_t target = add_result(passes, result);

    add_rows_back(passes, columns, weighing, target);
    return target;
}

uint32_t vkb_add_product(const struct vkb_convolving *passes, uint32_t spectrum,
                         const struct vkb_image_row *result)
{
    const uint32_t rows = vkb_add_rows(passes, passes->levels->source->glow, &vkb_unweighted);
    const uint32_t columns =
        vkb_add_spectrum(passes, "spectrum", vkb_padded_size(passes->convolution));
    const uint32_t target = add_result(passes, result);

    add_columns(passes, rows, &vkb_unweighted, spectrum, columns);
    add_columns_back(passes, columns, spectrum, &vkb_unweighted, columns);
    add_rows_back(passes, columns, &vkb_unweighted, target);
    return target;
}

struct vkb_pass_row vkb_find_transform(const struct vkb_graph *graph)
{
    uint32_t pass = 0;

    while (!vkb_computes(&graph->passes[pass], VKB_BLOCK_fft)
           || graph->passes[pass].constants.stage != STAGE_FIRST)
        ++pass;
    return graph->passes[pass];
}

uint32_t vkb_convolve_back(struct vkb_levels *levels, const struct vkb_convolution *convolution,
                           uint32_t spectrum, const struct vkb_image_row *result)
{
    const struct vkb_convolving passes = {.levels = levels,
                                          .convolution = convolution,
                                          .prefix = "adjoint_",
                                          .suffix = "",
                                          .transposed = true};

    return vkb_add_product(&passes, spectrum, result);
}
