// The convolution with a kernel that depends on the place: the sum of convolutions with kernels
// K_k, whose weights w_k depend on the place.
//
// Where a light shows the kernel of its own place, weights are multiplied before the convolution:
// sum of K_k * (w_k x). Each weighted image has a transform; the products with the kernels' spectra
// are added up, so that there is one way back. Where each pixel collects by its own kernel, they
// are multiplied after it: sum of w_k (K_k * x). Then there is one transform, and a way back for
// each kernel. Each is the transpose of the other one, with conjugate spectra.
#include "methods/field.h"

#include <stdio.h>
#include <string.h>

enum { MAX_WEIGHTS_IMAGES = (VKB_MAX_FIELD + 3) / 4 };

// The images of a field: the spectra of its kernels, and the weights of each pixel, four in each
// image.
struct field {
    uint32_t spectra[VKB_MAX_FIELD];
    uint32_t weights[MAX_WEIGHTS_IMAGES];
};

// A copy for the images of kernel k.
#define VKB_OF_KERNEL(of, passes, k) \
    char suffix_of_##of[VKB_NAME_SIZE]; \
    struct vkb_convolving of = *(passes); \
    snprintf(suffix_of_##of, sizeof suffix_of_##of, "_%u", (k)); \
    of.suffix = suffix_of_##of

static bool is_weighted(const struct vkb_field *field, uint32_t k)
{
    return k > 0 || !field->first_unweighted;
}

// Kernel k as the host gives it.
static uint32_t add_kernel(struct vkb_levels *levels, uint32_t k)
{
    const struct vkb_kernel_data *kernels = &levels->settings->kernel;
    const size_t floats = (size_t)kernels->width * kernels->height * (kernels->grey ? 1 : 4);
    struct vkb_kernel_data data = *kernels;
    char name[VKB_NAME_SIZE];

    snprintf(name, sizeof name, "kernel_%u", k);
    data.pixels = kernels->pixels ? kernels->pixels + k * floats : NULL;
    data.serial = vkb_hash_word(kernels->serial, k);
    const struct vkb_image_row row = vkb_given_image(name, &data);
    return vkb_levels_add(levels, &row);
}

// Adds the weights of each pixel of the buffers, which depend on no picture.
static void add_weights(struct vkb_levels *levels, uint32_t *weights)
{
    const struct vkb_field *data = &levels->settings->field;
    const struct vkb_image_row of_grid = vkb_given_image("field_grid", &data->weights);
    const struct vkb_image_row of_places = vkb_given_image("field_places", &data->places);
    const uint32_t grid = vkb_levels_add(levels, &of_grid);
    const uint32_t places = vkb_levels_add(levels, &of_places);

    for (uint32_t i = 0; i < (data->count + 3) / 4; ++i) {
        char name[VKB_NAME_SIZE];
        snprintf(name, sizeof name, "field_weights_%u", i);
        weights[i] = vkb_levels_target(levels, name, VKB_FORMAT_RGBA32_FLOAT,
                                       levels->source->buffers, false);
        struct vkb_pass_row row =
            vkb_fullscreen_row("kernel", &vkb_shader_field_weights_frag, weights[i]);
        vkb_read_only(&row, grid);
        vkb_read_at(&row, SLOT_PLACES, places);
        row.block = VKB_BLOCK_field_weights;
        row.params.field_weights = (struct vkb_field_weights_params){
            .grid = (int)i,
            .columns = (int)data->columns,
            .rows = (int)data->rows,
            .grids = (int)(data->weights.width / data->columns),
        };
        vkb_levels_pass(levels, &row);
    }
}

static struct field add_images(const struct vkb_convolving *passes)
{
    struct field field = {0};

    add_weights(passes->levels, field.weights);
    for (uint32_t k = 0; k < passes->levels->settings->field.count; ++k) {
        VKB_OF_KERNEL(own, passes, k);
        field.spectra[k] = vkb_add_kernel_spectrum(&own, add_kernel(passes->levels, k));
    }
    return field;
}

// The row that multiplies an image by weight k.
static struct vkb_pass_row weigh_row(const struct field *field, uint32_t k, uint32_t source,
                                     uint32_t target)
{
    struct vkb_pass_row row = vkb_fullscreen_row("weights", &vkb_shader_weigh_frag, target);

    vkb_read_only(&row, source);
    vkb_read_at(&row, SLOT_WEIGHTS, field->weights[k / 4]);
    vkb_read_at(&row, SLOT_ADDED, VKB_NO_IMAGE);
    row.block = VKB_BLOCK_weigh;
    row.params.weigh.channel = (int)(k % 4);
    return row;
}

// Adds the image times weight k, where that is not 1.
static uint32_t add_weighted(const struct vkb_convolving *passes, const struct field *field,
                             uint32_t k, uint32_t image)
{
    struct vkb_levels *levels = passes->levels;

    if (!is_weighted(&levels->settings->field, k) || levels->failed)
        return image;
    const struct vkb_size size = {levels->graph->images[image].width,
                                  levels->graph->images[image].height};
    VKB_OF_KERNEL(own, passes, k);
    const uint32_t target = vkb_add_spectrum(&own, "weighted", size);
    const struct vkb_pass_row row = weigh_row(field, k, image, target);
    vkb_levels_pass(levels, &row);
    return target;
}

static void set_radices(const struct vkb_convolution *convolution,
                        struct vkb_products_params *params)
{
    const uint32_t *x = convolution->x.line.radices, *y = convolution->y.line.radices;

    params->row_length = (int)convolution->x.line.length;
    params->row_a = (int)x[0];
    params->row_b = (int)x[1];
    params->row_c = (int)x[2];
    params->row_d = (int)x[3];
    params->column_length = (int)convolution->y.line.length;
    params->column_a = (int)y[0];
    params->column_b = (int)y[1];
    params->column_c = (int)y[2];
    params->column_d = (int)y[3];
}

// Adds the sum of products of spectra of images and kernels. `added` is a sum that is added;
// VKB_NO_IMAGE: none.
static uint32_t add_products(const struct vkb_convolving *passes, const uint32_t *images,
                             const uint32_t *kernels, uint32_t count, uint32_t added)
{
    const uint32_t target =
        vkb_add_spectrum(passes, "product", vkb_padded_size(passes->convolution));
    struct vkb_pass_row row = vkb_fullscreen_row("products", &vkb_shader_products_frag, target);

    vkb_read_only(&row, added);
    vkb_read_at(&row, (enum vkb_slot)(SLOT_FACTORS + 2 * MAX_PRODUCTS - 1), VKB_NO_IMAGE);
    for (uint32_t i = 0; i < count; ++i) {
        row.reads[SLOT_FACTORS + 2 * i] = images[i];
        row.reads[SLOT_FACTORS + 2 * i + 1] = kernels[i];
    }
    row.constants.adds_image = added != VKB_NO_IMAGE;
    row.constants.products = (int32_t)count;
    row.constants.stage = passes->levels->settings->kernel.grey ? STAGE_GREY : STAGE_PRODUCT;
    row.block = VKB_BLOCK_products;
    row.transform = vkb_transform_of(passes->convolution, 0);
    row.params.products.kernel_sign = vkb_conjugates(passes) ? -1.0f : 1.0f;
    if (!passes->levels->settings->kernel.grey)
        set_radices(passes->convolution, &row.params.products);
    vkb_levels_pass(passes->levels, &row);
    return target;
}

// Adds the sum of K_k * (w_k image).
static uint32_t add_spread(const struct vkb_convolving *passes, const struct field *field,
                           uint32_t image, const struct vkb_image_row *result)
{
    const uint32_t count = passes->levels->settings->field.count;
    uint32_t sum = VKB_NO_IMAGE, images[VKB_MAX_FIELD];

    for (uint32_t k = 0; k < count; ++k) {
        VKB_OF_KERNEL(own, passes, k);
        images[k] = vkb_add_forth(&own, add_weighted(passes, field, k, image));
    }
    for (uint32_t k = 0; k < count; k += MAX_PRODUCTS) {
        const uint32_t some = count - k < MAX_PRODUCTS ? count - k : MAX_PRODUCTS;
        VKB_OF_KERNEL(own, passes, k);
        sum = add_products(&own, images + k, field->spectra + k, some, sum);
    }
    return vkb_add_back(passes, sum, result);
}

// Adds K_k * image of each kernel.
static void add_each(const struct vkb_convolving *passes, const struct field *field, uint32_t image,
                     uint32_t *results)
{
    const uint32_t spectrum = vkb_add_forth(passes, image);

    for (uint32_t k = 0; k < passes->levels->settings->field.count; ++k) {
        struct vkb_image_row result = {.format = VKB_FORMAT_RGBA32_FLOAT};
        VKB_OF_KERNEL(own, passes, k);
        snprintf(result.name, sizeof result.name, "%scollected_%u", passes->prefix, k);
        const uint32_t product = add_products(&own, &spectrum, field->spectra + k, 1, VKB_NO_IMAGE);
        results[k] = vkb_add_back(&own, product, &result);
    }
}

// Adds the sum of w_k (K_k * image).
static uint32_t add_gathered(const struct vkb_convolving *passes, const struct field *field,
                             uint32_t image, const struct vkb_image_row *result)
{
    struct vkb_levels *levels = passes->levels;
    const struct vkb_size size = passes->convolution->result;
    const uint32_t count = levels->settings->field.count;
    uint32_t sum = VKB_NO_IMAGE, each[VKB_MAX_FIELD];

    add_each(passes, field, image, each);
    for (uint32_t k = 0; k < count; ++k) {
        VKB_OF_KERNEL(own, passes, k);
        const uint32_t target = k < count - 1
                                  ? vkb_add_spectrum(&own, "gathered", size)
                                  : vkb_levels_target(levels, result->name, result->format, size,
                                                      result->framebuffer);
        struct vkb_pass_row row = weigh_row(field, k, each[k], target);
        row.constants.adds_image = sum != VKB_NO_IMAGE;
        row.reads[SLOT_ADDED] = sum;
        vkb_levels_pass(levels, &row);
        sum = target;
    }
    return sum;
}

uint32_t vkb_convolve_field(const struct vkb_convolving *passes, const struct vkb_image_row *result)
{
    const struct field field = add_images(passes);
    const uint32_t glow = passes->levels->source->glow;

    return passes->levels->settings->field.gathers ? add_gathered(passes, &field, glow, result)
                                                   : add_spread(passes, &field, glow, result);
}

// Finds the images of a field by the passes that make and read them.
static struct field find_images(const struct vkb_graph *graph)
{
    struct field field = {0};
    uint32_t count = 0, weights = 0;

    for (uint32_t i = 0; i < graph->pass_count; ++i) {
        const struct vkb_pass_row *pass = &graph->passes[i];
        if (vkb_computes(pass, VKB_BLOCK_field_weights))
            field.weights[weights++] = pass->targets[0];
        if (vkb_computes(pass, VKB_BLOCK_products))
            for (int32_t k = 0; k < pass->constants.products; ++k)
                field.spectra[count++] = pass->reads[SLOT_FACTORS + 2 * k + 1];
    }
    return field;
}

// The image that is convolved: what the first weight multiplies, or the first transform reads.
static uint32_t find_glow(const struct vkb_graph *graph, bool gathers)
{
    for (uint32_t i = 0; i < graph->pass_count; ++i) {
        const struct vkb_pass_row *pass = &graph->passes[i];
        if (vkb_computes(pass, gathers ? VKB_BLOCK_fft : VKB_BLOCK_weigh)
            && (!gathers || pass->constants.stage == STAGE_FIRST))
            return pass->reads[SLOT_SOURCE];
    }
    return VKB_NO_IMAGE;
}

// The filter by which what lies beyond edges that are repeated folds back to these.
static struct vkb_filter fold_of(const struct vkb_convolution *convolution, struct vkb_size size)
{
    struct vkb_filter filter = {.kernels = 1, .gain = 1.0, .divisor = 1.0};

    vkb_axis_move(&filter.x, size.width, convolution->result.width, -(double)convolution->x.first);
    vkb_axis_move(&filter.y, size.height, convolution->result.height,
                  -(double)convolution->y.first);
    return filter;
}

// Accumulates w_k of what was folded from the results of all kernels.
static bool accumulate_weighted(struct vkb_adjoint *adjoint, const struct vkb_settings *settings,
                                const struct field *field, const struct vkb_filter *fold,
                                const uint32_t *each, uint32_t glow, struct vkb_error *error)
{
    const struct vkb_size size = {adjoint->graph->images[glow].width,
                                  adjoint->graph->images[glow].height};

    for (uint32_t k = 0; k < settings->field.count; ++k) {
        uint32_t folded;
        if (!is_weighted(&settings->field, k)) {
            if (!vkb_accumulate_filter(adjoint, fold, each[k], glow, error))
                return false;
            continue;
        }
        if (!vkb_filter_to_image(adjoint, fold, each[k], size, &folded, error))
            return false;
        struct vkb_pass_row row = vkb_adjoint_row(&vkb_shader_adjoint_weigh_frag, folded);
        row.reads[SLOT_WEIGHTS] = field->weights[k / 4];
        row.block = VKB_BLOCK_weigh;
        row.params.weigh.channel = (int)(k % 4);
        if (!vkb_accumulate_cotangent(adjoint, &row, glow, error))
            return false;
    }
    return true;
}

bool vkb_transpose_field(struct vkb_adjoint *adjoint, const struct vkb_settings *settings,
                         const struct vkb_pass_row *pass, struct vkb_error *error)
{
    struct vkb_graph *graph = adjoint->graph;
    const bool gathers = settings->field.gathers;
    const uint32_t glow = find_glow(graph, gathers), cotangents = vkb_cotangent_of(adjoint, pass);
    const struct field field = find_images(graph);
    const struct vkb_size size = {graph->images[glow].width, graph->images[glow].height};
    struct vkb_convolution convolution = vkb_describe_convolution(settings, size);
    struct vkb_bloom_source source = {.buffers = size, .glow = cotangents};
    const struct vkb_image_row result = {.name = "adjoint_convolved",
                                         .format = VKB_FORMAT_RGBA32_FLOAT};
    struct vkb_levels levels = {
        .settings = settings, .source = &source, .graph = graph, .error = error};
    const struct vkb_convolving passes = {.levels = &levels,
                                          .convolution = &convolution,
                                          .prefix = "adjoint_",
                                          .suffix = "",
                                          .transposed = true};
    uint32_t each[VKB_MAX_FIELD];

    vkb_transpose_axes(&convolution);
    const struct vkb_filter fold = fold_of(&convolution, size);
    if (gathers) {
        const uint32_t spread = add_spread(&passes, &field, cotangents, &result);
        return !levels.failed && vkb_accumulate_filter(adjoint, &fold, spread, glow, error);
    }
    add_each(&passes, &field, cotangents, each);
    return !levels.failed
        && accumulate_weighted(adjoint, settings, &field, &fold, each, glow, error);
}
