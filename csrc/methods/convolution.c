// A convolution by Fourier transforms: the glow along its rows, then along its columns, times the
// kernel's spectrum, and the way back along columns and rows. The kernel's spectrum is an image of
// its own.
//
// Along an axis the glow has `extent` pixels, and of the kernel count the offsets from -before to
// after: what reaches farther falls outside everywhere (zero), is added to the last offset (edge),
// or to the one a period away (wrap). Transforms are periodic, so that the lines are padded by as
// much as the kernel reaches: on both sides for an edge or a mirror, whose pixels lie there; on the
// longer side for zeros, which both sides share; not at all for a period that a transform can have.
#include "methods/methods.h"
#include "passes/fft.h"
#include "passes/prefilter.h"

#include <stdio.h>

// Of the kernel along an axis: its pixels, the offsets that count, and what becomes of the others;
// where the result begins, before the first texel.
struct reach {
    uint32_t kernel, before, after;
    enum vkb_boundary boundary;
    uint32_t spread;
};

// Both axes of a convolution.
struct convolution {
    struct vkb_levels *levels;
    const char *prefix;  // of the names of images
    struct vkb_fft_axis x, y;
    struct reach reach_x, reach_y;
};

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

// The largest radix for an image. The pipelines of larger ones take a new process longer than the
// stages that they save in small images.
static uint32_t most_radix(struct vkb_size size)
{
    return (uint64_t)size.width * size.height <= FFT_SMALL_PIXELS ? FFT_SMALL_RADIX : FFT_MAX_RADIX;
}

static struct vkb_fft_axis make_axis(enum vkb_mode direction, enum vkb_boundary boundary,
                                     bool spreads, uint32_t extent, uint32_t most,
                                     struct reach *reach)
{
    const uint32_t kernel = reach->kernel;
    struct vkb_fft_axis axis = {.direction = direction, .boundary = boundary, .extent = extent};

    reach->boundary = boundary;
    reach->before = least(kernel / 2, boundary == BOUNDARY_MIRROR ? extent : extent - 1);
    reach->after = least(kernel - 1 - kernel / 2, extent - 1);
    uint32_t padding = reach->before + reach->after;
    if (boundary == BOUNDARY_WRAP && kernel >= extent) {
        reach->before = extent / 2;
        reach->after = extent - 1 - extent / 2;
        padding = extent - 1;
    }
    if (boundary == BOUNDARY_WRAP && vkb_fft_line(extent, most).length == extent)
        padding = 0;
    if (boundary == BOUNDARY_ZERO)
        padding = reach->before > reach->after ? reach->before : reach->after;
    axis.before = reach->before;
    if (spreads && boundary == BOUNDARY_EDGE) {
        axis.boundary = BOUNDARY_ZERO;
        reach->spread = reach->before;
    }
    axis.line = vkb_fft_line(extent + padding, most);
    return axis;
}

// The kernel as the host gives it.
static uint32_t add_kernel(const struct convolution *convolution)
{
    struct vkb_levels *levels = convolution->levels;
    const struct vkb_kernel_data *kernel = &levels->settings->kernel;
    struct vkb_image_row row = {
        .format = VKB_FORMAT_RGBA32_FLOAT,
        .width = kernel->width,
        .height = kernel->height,
        .channels = 3,
        .framebuffer = !*convolution->prefix,
        .pixels = kernel->pixels,
        .serial = kernel->serial,
    };

    snprintf(row.name, sizeof row.name, "%skernel", convolution->prefix);
    return vkb_levels_add(levels, &row);
}

static uint32_t add_spectrum(const struct convolution *convolution, const char *name,
                             struct vkb_size size)
{
    char named[VKB_NAME_SIZE];

    snprintf(named, sizeof named, "%s%s", convolution->prefix, name);
    return vkb_levels_target(convolution->levels, named, VKB_FORMAT_RGBA32_FLOAT, size, false);
}

static struct vkb_transform transform_of(const struct convolution *convolution, uint32_t stages)
{
    const struct vkb_fft_axis *x = &convolution->x, *y = &convolution->y;

    return (struct vkb_transform){
        .width = x->line.length,
        .height = y->line.length,
        .pads_rows = x->line.length > x->extent,
        .pads_columns = y->line.length > y->extent,
        .stages = stages,
    };
}

// The pass that puts the kernel to its places in the padded lines.
static void add_placing(const struct convolution *convolution, uint32_t kernel, uint32_t spectrum)
{
    const struct vkb_fft_axis *x = &convolution->x, *y = &convolution->y;
    struct vkb_pass_row row = vkb_fullscreen_row("kernel", &vkb_shader_fft_kernel_comp, spectrum);
    struct vkb_fft_kernel_params *params = &row.params.fft_kernel;

    row.geometry = VKB_GEOMETRY_DISPATCH;
    row.vertex = NULL;
    row.variant = "dispatch";
    row.block_width = row.block_height = PIXEL_INVOCATIONS;
    vkb_read_only(&row, kernel);
    row.block = VKB_BLOCK_fft_kernel;
    row.transform = transform_of(convolution, 0);
    *params = (struct vkb_fft_kernel_params){
        .padded_x = (int)x->line.length,
        .boundary_x = convolution->reach_x.boundary,
        .extent_x = (int)convolution->reach_x.kernel,
        .period_x = (int)x->extent,
        .before_x = (int)convolution->reach_x.before,
        .after_x = (int)convolution->reach_x.after,
        .spread_x = (int)convolution->reach_x.spread,
        .padded_y = (int)y->line.length,
        .boundary_y = convolution->reach_y.boundary,
        .extent_y = (int)convolution->reach_y.kernel,
        .period_y = (int)y->extent,
        .before_y = (int)convolution->reach_y.before,
        .after_y = (int)convolution->reach_y.after,
        .spread_y = (int)convolution->reach_y.spread,
        .grey = convolution->levels->settings->kernel.grey,
        // That of the way back.
        .gain = (float)(1.0 / ((double)x->line.length * y->line.length)),
    };
    vkb_levels_pass(convolution->levels, &row);
}

// The row of a stage, of `stages` that follow each other from this one on; 0: from one before.
static struct vkb_pass_row stage_row(const struct convolution *convolution,
                                     const struct vkb_fft_stage *stage, uint32_t stages)
{
    struct vkb_pass_row row = vkb_fft_row(convolution->levels->graph, stage);

    row.transform = transform_of(convolution, stages);
    return row;
}

// The kernel's spectrum, in place.
static void add_kernel_spectrum(const struct convolution *convolution, uint32_t spectrum)
{
    const struct vkb_fft_axis *axes[] = {&convolution->x, &convolution->y};

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
            struct vkb_pass_row row = stage_row(convolution, &stage, stage.number == 0 ? count : 0);
            row.params.fft.extent = INT32_MAX;
            vkb_levels_pass(convolution->levels, &row);
            stage.padded = false;
        }
    }
}

// The glow's transform along its rows.
static void add_rows(const struct convolution *convolution, uint32_t rows)
{
    const float *prefilter = convolution->levels->settings->kernel.prefilter;
    struct vkb_fft_stage stage = {
        .name = "spectrum",
        .axis = &convolution->x,
        .lines = convolution->y.extent,
        .padded = convolution->x.line.length > convolution->x.extent,
        .from = convolution->levels->source->glow,
        .to = rows,
    };
    const uint32_t count = stage.axis->line.stage_count;

    for (; stage.number < count; ++stage.number) {
        struct vkb_pass_row row = stage_row(convolution, &stage, stage.number == 0 ? count : 0);
        if (stage.number == 0) {
            row.constants.stage = STAGE_FIRST;
            row.constants.prefiltered = prefilter[1] >= prefilter[0];
            row.params.fft.prefilter_min = prefilter[0];
            row.params.fft.prefilter_max = prefilter[1];
            row.params.fft.prefilter_factor = prefilter[2];
        }
        vkb_levels_pass(convolution->levels, &row);
        stage.padded = false;
        stage.from = rows;
    }
}

// Along the columns forth and back, with the product between.
static void add_columns(const struct convolution *convolution, uint32_t rows, uint32_t spectrum,
                        uint32_t columns, uint32_t height)
{
    const uint32_t last = convolution->y.line.stage_count - 1;
    struct vkb_fft_stage stage = {
        .name = "bloom",
        .axis = &convolution->y,
        .lines = convolution->x.line.length,
        .padded = convolution->y.line.length > convolution->y.extent,
        .from = rows,
        .to = columns,
    };

    for (; stage.number <= last; ++stage.number) {
        struct vkb_pass_row row =
            stage_row(convolution, &stage, stage.number == 0 ? 2 * last + 1 : 0);
        if (stage.number == last)
            vkb_fft_multiply(&convolution->x, &convolution->y, spectrum,
                             convolution->levels->settings->kernel.grey, &row);
        vkb_levels_pass(convolution->levels, &row);
        stage.padded = false;
        stage.from = columns;
    }
    stage.inverse = true;
    for (stage.number = last; stage.number-- > 0;) {
        struct vkb_pass_row row = stage_row(convolution, &stage, 0);
        // The rows back need no other.
        if (stage.number == 0)
            row.params.fft.kept = (int)height;
        vkb_levels_pass(convolution->levels, &row);
    }
}

static void add_rows_back(const struct convolution *convolution, uint32_t columns, uint32_t height,
                          uint32_t target)
{
    struct vkb_fft_stage stage = {
        .name = "bloom",
        .axis = &convolution->x,
        .lines = height,
        .inverse = true,
        .from = columns,
    };
    const uint32_t count = stage.axis->line.stage_count;

    for (stage.number = count; stage.number-- > 0;) {
        stage.to = stage.number ? columns : target;
        struct vkb_pass_row row =
            stage_row(convolution, &stage, stage.number == count - 1 ? count : 0);
        if (stage.number == 0)
            row.constants.stage = STAGE_LAST;
        vkb_levels_pass(convolution->levels, &row);
    }
}

// The result along an axis.
static uint32_t extent_of(const struct vkb_fft_axis *axis, const struct reach *reach)
{
    return axis->extent + (reach->spread ? reach->before + reach->after : 0);
}

uint32_t vkb_convolve(struct vkb_levels *levels, const struct vkb_image_row *result,
                      const char *prefix, bool spreads)
{
    const struct vkb_settings *settings = levels->settings;
    const int boundary = settings->choices[VKB_CHOICE_boundary];
    const bool wrap_x = boundary == BOUNDARY_WRAP_X;
    const struct vkb_size size = levels->source->buffers;
    struct convolution convolution = {
        .levels = levels,
        .prefix = prefix,
        .reach_x.kernel = settings->kernel.width,
        .reach_y.kernel = settings->kernel.height,
    };

    convolution.x =
        make_axis(DIRECTION_HORIZONTAL, wrap_x ? BOUNDARY_WRAP : (enum vkb_boundary)boundary,
                  spreads, size.width, most_radix(size), &convolution.reach_x);
    convolution.y =
        make_axis(DIRECTION_VERTICAL, wrap_x ? BOUNDARY_EDGE : (enum vkb_boundary)boundary, spreads,
                  size.height, most_radix(size), &convolution.reach_y);
    const struct vkb_size padded = {convolution.x.line.length, convolution.y.line.length};
    const struct vkb_size whole = {extent_of(&convolution.x, &convolution.reach_x),
                                   extent_of(&convolution.y, &convolution.reach_y)};
    const struct vkb_size lines = {padded.width, whole.height};
    const uint32_t kernel = add_kernel(&convolution);
    const uint32_t spectrum = add_spectrum(&convolution, "kernel_spectrum", padded);
    const uint32_t rows = add_spectrum(&convolution, "rows_spectrum", lines);
    const uint32_t columns = add_spectrum(&convolution, "spectrum", padded);
    const uint32_t target =
        vkb_levels_target(levels, result->name, result->format, whole, result->framebuffer);
    add_placing(&convolution, kernel, spectrum);
    add_kernel_spectrum(&convolution, spectrum);
    add_rows(&convolution, rows);
    add_columns(&convolution, rows, spectrum, columns, whole.height);
    add_rows_back(&convolution, columns, whole.height, target);
    return target;
}

uint32_t vkb_add_convolution_method(struct vkb_levels *levels)
{
    const struct vkb_bloom_source *source = levels->source;
    const struct vkb_size size = source->buffers;
    const bool same = size.width == source->final.width && size.height == source->final.height;
    const struct vkb_image_row whole = {
        .name = "bloom", .format = source->format, .framebuffer = true};
    const struct vkb_image_row part = {.name = "convolved", .format = VKB_FORMAT_RGBA32_FLOAT};
    const uint32_t convolved = vkb_convolve(levels, same ? &whole : &part, "", false);

    return same ? convolved : vkb_levels_enlarge(levels, UPSAMPLE_LINEAR, convolved, 1.0);
}

// Film's halation: the kernel is a sum of Gaussians, too.
uint32_t vkb_add_halation_method(struct vkb_levels *levels)
{
    return vkb_add_unreal_method(levels);
}

// Unreal Engine's standard bloom, by its documentation: the kernel is a sum of Gaussians.
uint32_t vkb_add_unreal_method(struct vkb_levels *levels)
{
    const struct vkb_bloom_source *source = levels->source;
    struct vkb_bloom_source masked = *source;

    if (source->mask != VKB_NO_IMAGE || levels->settings->thresholded) {
        masked.glow = vkb_levels_step(levels, source->buffers, "highlights");
        struct vkb_pass_row row =
            vkb_describe_prefilter(levels, VKB_PREFILTER_unreal, source->glow, masked.glow);
        vkb_levels_masked(levels, &row);
    }
    levels->source = &masked;
    const uint32_t bloom = vkb_add_convolution_method(levels);
    levels->source = source;
    return bloom;
}
