// A convolution by Fourier transforms: the glow and the kernel along their rows and columns, the
// product on the way back along the columns, then the rows.
//
// Along an axis the glow has `extent` pixels, and of the kernel count the offsets from -before to
// after: what reaches farther falls outside everywhere (zero), is added to the last offset (edge),
// or to the one a period away (wrap). Transforms are periodic, so that the lines are padded by as
// much as the kernel reaches: on both sides for an edge, whose pixels lie there; on the longer side
// for zeros, which both sides share; not at all for a period that a transform can have.
#include "methods/methods.h"
#include "passes/fft.h"
#include "passes/levels.h"

#include <string.h>

struct axis {
    enum vkb_mode direction;
    enum vkb_boundary boundary;
    uint32_t extent, kernel;
    uint32_t before, after;  // offsets
    struct vkb_fft_axis fft;
};

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

static struct axis make_axis(enum vkb_mode direction, enum vkb_boundary boundary, uint32_t extent,
                             uint32_t kernel)
{
    struct axis axis = {
        .direction = direction,
        .boundary = boundary,
        .extent = extent,
        .kernel = kernel,
        .before = least(kernel / 2, extent - 1),
        .after = least(kernel - 1 - kernel / 2, extent - 1),
    };
    uint32_t padding = axis.before + axis.after;

    if (boundary == BOUNDARY_WRAP && kernel >= extent) {
        axis.before = extent / 2;
        axis.after = extent - 1 - extent / 2;
        padding = extent - 1;
    }
    if (boundary == BOUNDARY_WRAP && vkb_fft_axis(extent).padded == extent)
        padding = 0;
    if (boundary == BOUNDARY_ZERO)
        padding = axis.before > axis.after ? axis.before : axis.after;
    axis.fft = vkb_fft_axis(extent + padding);
    return axis;
}

// Both axes of a convolution, and its two spectra.
struct convolution {
    const struct vkb_settings *settings;
    struct vkb_graph *graph;
    struct axis x, y;
    struct vkb_size buffers;
};

static struct vkb_fft_input read_glow(const struct convolution *convolution,
                                      const struct axis *axis, enum vkb_mode load)
{
    const float *prefilter = convolution->settings->kernel.prefilter;
    struct vkb_fft_input input = {.load = load, .boundary = axis->boundary};

    input.params.extent = (int)axis->extent;
    input.params.turn = (int)(axis->extent + axis->before);
    if (load == FFT_LOAD_GLOW) {
        input.params.prefilter_min = prefilter[0];
        input.params.prefilter_max = prefilter[1];
        input.params.prefilter_factor = prefilter[2];
    }
    return input;
}

static struct vkb_fft_input read_kernel(const struct convolution *convolution,
                                        const struct axis *axis)
{
    const double pixels = (double)convolution->x.fft.padded * convolution->y.fft.padded;
    struct vkb_fft_input input = {
        .load = FFT_LOAD_KERNEL,
        .boundary = axis->boundary,
        .grey = convolution->settings->kernel.grey,
    };

    input.params.extent = (int)axis->kernel;
    input.params.centre = (int)(axis->kernel / 2);
    input.params.period = (int)axis->extent;
    input.params.reach_before = (int)axis->before;
    input.params.reach_after = (int)axis->after;
    // That of the way back, once.
    input.params.gain = axis == &convolution->x ? (float)(1.0 / pixels) : 1.0f;
    return input;
}

static struct vkb_fft_input read_product(const struct convolution *convolution)
{
    struct vkb_fft_input input = {
        .load = FFT_LOAD_PRODUCT,
        .boundary = BOUNDARY_ZERO,
        .grey = convolution->settings->kernel.grey,
    };

    input.params.long_x = (int)convolution->x.fft.length;
    input.params.short_x = (int)convolution->x.fft.parts;
    input.params.long_y = (int)convolution->y.fft.length;
    input.params.short_y = (int)convolution->y.fft.parts;
    return input;
}

// The spectrum of the glow or of the kernel.
static bool add_spectrum(const struct convolution *convolution, bool kernel, uint32_t from,
                         uint32_t *spectrum, struct vkb_error *error)
{
    const uint32_t width = convolution->x.fft.padded, height = convolution->y.fft.padded;
    struct vkb_fft rows = {
        .pass = kernel ? "kernel" : "spectrum",
        .image = kernel ? "kernel_rows" : "glow_rows",
        .direction = DIRECTION_HORIZONTAL,
        .axis = convolution->x.fft,
        .input = kernel ? read_kernel(convolution, &convolution->x)
                        : read_glow(convolution, &convolution->x, FFT_LOAD_GLOW),
        .from = from,
        .size = {width, convolution->graph->images[from].height},
        .target = VKB_NO_IMAGE,
    };
    struct vkb_fft columns = rows;

    columns.image = kernel ? "kernel_spectrum" : "glow_spectrum";
    columns.direction = DIRECTION_VERTICAL;
    columns.axis = convolution->y.fft;
    columns.input = kernel ? read_kernel(convolution, &convolution->y)
                           : read_glow(convolution, &convolution->y, FFT_LOAD_SPECTRUM);
    columns.size = (struct vkb_size){width, height};
    return vkb_add_fft(convolution->graph, &rows, &columns.from, error)
        && vkb_add_fft(convolution->graph, &columns, spectrum, error);
}

// From the spectra to an image of the bloom buffers' size.
static bool add_way_back(const struct convolution *convolution, uint32_t glow, uint32_t kernel,
                         uint32_t target, struct vkb_error *error)
{
    uint32_t result;
    struct vkb_fft columns = {
        .pass = "bloom",
        .image = "product_columns",
        .direction = DIRECTION_VERTICAL,
        .inverse = true,
        .axis = convolution->y.fft,
        .input = read_product(convolution),
        .from = glow,
        .factor = kernel,
        .size = {convolution->x.fft.padded, convolution->buffers.height},
        .target = VKB_NO_IMAGE,
    };
    struct vkb_fft rows = columns;

    rows.image = "product_rows";
    rows.direction = DIRECTION_HORIZONTAL;
    rows.axis = convolution->x.fft;
    rows.input = (struct vkb_fft_input){.load = FFT_LOAD_PART, .boundary = BOUNDARY_ZERO};
    rows.size = convolution->buffers;
    rows.target = target;
    return vkb_add_fft(convolution->graph, &columns, &rows.from, error)
        && vkb_add_fft(convolution->graph, &rows, &result, error);
}

static bool add_kernel(const struct vkb_kernel_data *kernel, struct vkb_graph *graph,
                       uint32_t *image, struct vkb_error *error)
{
    const struct vkb_image_row row = {
        .name = "kernel",
        .format = VKB_FORMAT_RGBA32_FLOAT,
        .width = kernel->width,
        .height = kernel->height,
        .channels = 3,
        .framebuffer = true,
        .pixels = kernel->pixels,
        .serial = kernel->serial,
    };

    return vkb_graph_add_image(graph, &row, image, error);
}

bool vkb_add_convolution(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                         struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    const int boundary = settings->choices[VKB_CHOICE_boundary];
    const bool wrap_x = boundary == BOUNDARY_WRAP_X;
    const struct vkb_size size = source->buffers;
    const bool same = size.width == source->final.width && size.height == source->final.height;
    const struct convolution convolution = {
        .settings = settings,
        .graph = graph,
        .x = make_axis(DIRECTION_HORIZONTAL, wrap_x ? BOUNDARY_WRAP : (enum vkb_boundary)boundary,
                       size.width, settings->kernel.width),
        .y = make_axis(DIRECTION_VERTICAL, wrap_x ? BOUNDARY_EDGE : (enum vkb_boundary)boundary,
                       size.height, settings->kernel.height),
        .buffers = size,
    };
    const struct vkb_levels levels = {.settings = settings, .source = source, .graph = graph};
    uint32_t kernel, spectrum, kernel_spectrum, target;

    if (!add_kernel(&settings->kernel, graph, &kernel, error)
        || !add_spectrum(&convolution, true, kernel, &kernel_spectrum, error)
        || !add_spectrum(&convolution, false, source->glow, &spectrum, error)
        || !vkb_add_target(graph, same ? "bloom" : "convolved",
                           same ? source->format : VKB_FORMAT_RGBA32_FLOAT, size, same, &target,
                           error)
        || !add_way_back(&convolution, spectrum, kernel_spectrum, target, error))
        return false;
    *bloom = target;
    return same || vkb_levels_enlarge(&levels, target, 1.0, bloom, error);
}
