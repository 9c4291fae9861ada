// The convolution with a kernel that depends on the place: the sum of convolutions with kernels
// K_k, whose weights w_k depend on the place.
//
// Where a light shows the kernel of its own place, weights are multiplied before the convolution:
// sum of K_k * (w_k x). Each weighted image has a transform; the products with the kernels' spectra
// are added up, so that there is one way back. Where each pixel collects by its own kernel, they
// are multiplied after it: sum of w_k (K_k * x). Then there is one transform, and a way back for
// each kernel. Each is the transpose of the other one, with conjugate spectra.
//
// Transforms multiply by weights where they read or store pixels. The weights of a grid are
// products of one of its column and one of its row, w_k = a_i(x) b_j(y). Then a transform along
// rows, of a_i x, is shared by the kernels of a column of the grid, whose transforms along columns
// begin with b_j; on the way back these end with b_j and are added up before the rows.
#include "methods/field.h"

#include <stdio.h>
#include <string.h>

enum { MAX_WEIGHTS_IMAGES = (VKB_MAX_FIELD + 3) / 4 };

// The images of a field: the spectra of its kernels, the weights of each pixel, four in each image,
// and the places of the pixels in the grid of weights.
struct field {
    uint32_t spectra[VKB_MAX_FIELD];
    uint32_t weights[MAX_WEIGHTS_IMAGES];
    uint32_t places;
};

// A copy for the images of kernel k.
#define VKB_OF_KERNEL(of, passes, k) \
    char suffix_of_##of[VKB_NAME_SIZE]; \
    struct vkb_convolving of = *(passes); \
    snprintf(suffix_of_##of, sizeof suffix_of_##of, "_%u", (k)); \
    of.suffix = suffix_of_##of

// Of column i of a grid, or of kernel i.
static struct vkb_weighing weigh_column(const struct vkb_field *data, const struct field *field,
                                        uint32_t i)
{
    if (i == 0 && data->first_unweighted)
        return vkb_unweighted;
    return (struct vkb_weighing){field->weights[i / 4], i % 4, VKB_NO_IMAGE};
}

// Of row j of a grid.
static struct vkb_weighing weigh_row(const struct vkb_field *data, const struct field *field,
                                     uint32_t j)
{
    const uint32_t number = data->count / data->down + j;

    if (data->down == 1)
        return vkb_unweighted;
    return (struct vkb_weighing){field->weights[number / 4], number % 4, VKB_NO_IMAGE};
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
static void add_weights(struct vkb_levels *levels, struct field *field)
{
    const struct vkb_field *data = &levels->settings->field;
    const struct vkb_image_row of_grid = vkb_given_image("field_grid", &data->weights);
    const struct vkb_image_row of_places = vkb_given_image("field_places", &data->places);
    const uint32_t grid = vkb_levels_add(levels, &of_grid);
    field->places = vkb_levels_add(levels, &of_places);
    const struct vkb_size *buffers = &levels->source->buffers;
    // Along an axis with one place they are the same. Transforms read the nearest pixel.
    const struct vkb_size size = {data->columns > 1 ? buffers->width : 1,
                                  data->rows > 1 ? buffers->height : 1};

    for (uint32_t i = 0; i < (vkb_count_weights(data) + 3) / 4; ++i) {
        char name[VKB_NAME_SIZE];
        snprintf(name, sizeof name, "field_weights_%u", i);
        field->weights[i] = vkb_levels_target(levels, name, VKB_FORMAT_RGBA32_FLOAT, size, false);
        struct vkb_pass_row row =
            vkb_fullscreen_row("kernel", &vkb_shader_field_weights_frag, field->weights[i]);
        vkb_read_only(&row, grid);
        vkb_read_at(&row, SLOT_PLACES, field->places);
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

    add_weights(passes->levels, &field);
    for (uint32_t k = 0; k < passes->levels->settings->field.count; ++k) {
        VKB_OF_KERNEL(own, passes, k);
        field.spectra[k] = vkb_add_kernel_spectrum(&own, add_kernel(passes->levels, k));
    }
    return field;
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
    row.transform = vkb_transform_of(passes, 0);
    // The alpha is one of a cotangent.
    if (passes->transposed)
        row.constants.alpha = ALPHA_BLUR;
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
    const struct vkb_field *data = &passes->levels->settings->field;
    uint32_t sum = VKB_NO_IMAGE, rows = VKB_NO_IMAGE, images[VKB_MAX_FIELD];

    for (uint32_t k = 0; k < data->count; ++k) {
        VKB_OF_KERNEL(own, passes, k);
        const struct vkb_weighing column = weigh_column(data, field, k / data->down);
        const struct vkb_weighing row = weigh_row(data, field, k % data->down);
        if (k % data->down == 0)
            rows = vkb_add_rows(&own, image, &column);
        images[k] = vkb_add_columns(&own, rows, &row);
    }
    for (uint32_t k = 0; k < data->count; k += MAX_PRODUCTS) {
        const uint32_t some = data->count - k < MAX_PRODUCTS ? data->count - k : MAX_PRODUCTS;
        VKB_OF_KERNEL(own, passes, k);
        sum = add_products(&own, images + k, field->spectra + k, some, sum);
    }
    const uint32_t columns = vkb_add_columns_back(passes, sum, VKB_NO_IMAGE, &vkb_unweighted);
    return vkb_add_rows_back(passes, columns, &vkb_unweighted, result);
}

// Adds the product of a spectrum and a kernel's, and its way back along columns.
static uint32_t add_product_back(const struct vkb_convolving *passes, uint32_t spectrum,
                                 uint32_t kernel, const struct vkb_weighing *weighing)
{
    if (passes->levels->settings->kernel.grey)
        return vkb_add_columns_back(passes, spectrum, kernel, weighing);
    const uint32_t product = add_products(passes, &spectrum, &kernel, 1, VKB_NO_IMAGE);
    return vkb_add_columns_back(passes, product, VKB_NO_IMAGE, weighing);
}

// Adds the sum of w_k (K_k * image).
static uint32_t add_gathered(const struct vkb_convolving *passes, const struct field *field,
                             uint32_t image, const struct vkb_image_row *result)
{
    const struct vkb_field *data = &passes->levels->settings->field;
    const uint32_t rows = vkb_add_rows(passes, image, &vkb_unweighted);
    const uint32_t spectrum = vkb_add_columns(passes, rows, &vkb_unweighted);
    uint32_t sum = VKB_NO_IMAGE, columns = VKB_NO_IMAGE;

    for (uint32_t k = 0; k < data->count; ++k) {
        VKB_OF_KERNEL(own, passes, k);
        struct vkb_weighing column = weigh_column(data, field, k / data->down);
        struct vkb_weighing row = weigh_row(data, field, k % data->down);
        row.added = k % data->down > 0 ? columns : VKB_NO_IMAGE;
        columns = add_product_back(&own, spectrum, field->spectra[k], &row);
        if (k % data->down < data->down - 1)
            continue;
        struct vkb_image_row part = {.format = VKB_FORMAT_RGBA32_FLOAT};
        snprintf(part.name, sizeof part.name, "%sgathered_%u", passes->prefix, k);
        column.added = sum;
        sum = vkb_add_rows_back(&own, columns, &column, k == data->count - 1 ? result : &part);
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
        if (vkb_computes(pass, VKB_BLOCK_field_weights)) {
            field.weights[weights++] = pass->targets[0];
            field.places = pass->reads[SLOT_PLACES];
        }
        if (vkb_computes(pass, VKB_BLOCK_products))
            for (int32_t k = 0; k < pass->constants.products; ++k)
                field.spectra[count++] = pass->reads[SLOT_FACTORS + 2 * k + 1];
        if (vkb_computes(pass, VKB_BLOCK_fft) && pass->constants.stage == STAGE_GREY)
            field.spectra[count++] = pass->reads[SLOT_SPECTRUM];
    }
    return field;
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

// The size of an image of two pictures of sums between places of the grid (adjoint_weights.frag),
// and what its pass has: of an image of `size`, along one axis.
static struct vkb_size size_sums(const struct vkb_field *data, struct vkb_size size, bool vertical,
                                 struct vkb_node_sums_params *params)
{
    const uint32_t nodes = vertical ? data->rows : data->columns;
    const uint32_t side = vertical ? size.height : size.width;
    const uint32_t cells = nodes > 1 ? nodes - 1 : 1;
    const uint32_t parts = (side + cells * NODE_PIXELS - 1) / (cells * NODE_PIXELS);
    const struct vkb_size sums = {vertical ? size.width : cells * parts,
                                  vertical ? cells * parts : size.height};

    *params = (struct vkb_node_sums_params){
        .cells = (int)cells, .parts = (int)parts, .lines = (int)sums.height};
    return (struct vkb_size){sums.width, 2 * sums.height};
}

// Whether the images of the sums are not too large. Only grids with more places than pixels have
// such ones.
static bool fits_sums(const struct vkb_adjoint *adjoint, const struct vkb_field *data,
                      struct vkb_size size)
{
    struct vkb_node_sums_params params;
    const struct vkb_size above = size_sums(data, size, true, &params);
    const struct vkb_size below =
        size_sums(data, (struct vkb_size){size.width, data->rows}, false, &params);
    const uint32_t max_side = adjoint->max_side;

    return above.height <= max_side && below.width <= max_side && below.height <= max_side;
}

// Adds the pass of such sums, and the one that adds these up at the places: the image `name`.
static uint32_t add_node_sums(struct vkb_levels *levels, struct vkb_pass_row row, bool vertical,
                              const char *name, bool framebuffer)
{
    const struct vkb_field *data = &levels->settings->field;
    const struct vkb_size size = vkb_size_of(levels->graph, row.reads[SLOT_SOURCE]);
    const struct vkb_size nodes = {vertical ? size.width : data->columns, data->rows};
    struct vkb_node_sums_params *params = &row.params.node_sums;
    const struct vkb_size of_sums = size_sums(data, size, vertical, params);
    char of_parts[VKB_NAME_SIZE];

    row.transposed = true;
    row.block = VKB_BLOCK_node_sums;
    row.constants.direction = vertical ? DIRECTION_VERTICAL : DIRECTION_HORIZONTAL;
    snprintf(of_parts, sizeof of_parts, "%s_parts", name);
    row.targets[0] = vkb_levels_target(levels, of_parts, VKB_FORMAT_RGBA32_FLOAT, of_sums, false);
    vkb_levels_pass(levels, &row);
    struct vkb_pass_row last = vkb_fullscreen_row(
        "weights", &vkb_shader_adjoint_nodes_frag,
        vkb_levels_target(levels, name, VKB_FORMAT_RGBA32_FLOAT, nodes, framebuffer));
    last.transposed = true;
    last.block = row.block;
    last.constants.direction = row.constants.direction;
    last.params = row.params;
    vkb_read_only(&last, row.targets[0]);
    vkb_levels_pass(levels, &last);
    return last.targets[0];
}

// Adds the framebuffer of the cotangents of up to four weights from the kernel `first` on: the sums
// over pixels, along columns and then along rows, of an image times the images of the kernels.
static void add_weights_back(struct vkb_levels *levels, uint32_t image, const uint32_t *each,
                             uint32_t first, uint32_t count, int32_t alpha, uint32_t places)
{
    struct vkb_pass_row row =
        vkb_fullscreen_row("weights", &vkb_shader_adjoint_weights_frag, VKB_NO_IMAGE);
    char name[VKB_NAME_SIZE];

    vkb_read_only(&row, image);
    vkb_read_at(&row, SLOT_NODES, places);
    for (uint32_t i = 0; i < count; ++i)
        vkb_read_at(&row, (enum vkb_slot)(SLOT_FACTORS + i), each[i]);
    row.constants.products = (int32_t)count;
    row.constants.alpha = alpha;
    snprintf(name, sizeof name, "adjoint_weight_rows_%u", first / 4);
    const uint32_t columns = add_node_sums(levels, row, true, name, false);
    row = vkb_fullscreen_row("weights", &vkb_shader_adjoint_weights_frag, VKB_NO_IMAGE);
    vkb_read_only(&row, columns);
    vkb_read_at(&row, SLOT_NODES, places);
    snprintf(name, sizeof name, ".by_weights_%u", first / 4);
    add_node_sums(levels, row, false, name, true);
}

// Adds the framebuffers of the cotangents of the weights, four in each, at the places of the grid:
// of the image times what the kernels make of the cotangents; or of the cotangents times what they
// make of the image, if pixels collect. No more than four such images are needed at a time.
static bool add_by_weights(struct vkb_adjoint *adjoint, const struct vkb_convolving *transposed,
                           const struct field *field, const struct vkb_filter *fold, uint32_t glow,
                           uint32_t cotangents, struct vkb_error *error)
{
    struct vkb_levels *levels = transposed->levels;
    const struct vkb_settings *settings = levels->settings;
    const struct vkb_size size = levels->source->buffers;
    const struct vkb_convolution forward = vkb_describe_convolution(settings, size);
    const bool gathers = settings->field.gathers;
    const bool moved = !vkb_axis_is_identity(&fold->x) || !vkb_axis_is_identity(&fold->y);
    const int32_t alpha = vkb_find_transform(adjoint->graph).constants.alpha;
    const uint32_t first = adjoint->graph->pass_count;
    struct vkb_convolving passes = *transposed;
    uint32_t each[4];

    // The passes of other derivatives have the prefix, too.
    passes.prefix = "adjoint_weights_";
    if (gathers) {
        passes.convolution = &forward;
        passes.transposed = false;
    }
    const uint32_t rows = vkb_add_rows(&passes, gathers ? glow : cotangents, &vkb_unweighted);
    const uint32_t spectrum = vkb_add_columns(&passes, rows, &vkb_unweighted);
    for (uint32_t k = 0; k < settings->field.count && !levels->failed; ++k) {
        struct vkb_image_row result = {.format = VKB_FORMAT_RGBA32_FLOAT};
        uint32_t *convolved = &each[k % 4];
        VKB_OF_KERNEL(own, &passes, k);
        snprintf(result.name, sizeof result.name, "%sconvolved_%u", passes.prefix, k);
        const uint32_t columns =
            add_product_back(&own, spectrum, field->spectra[k], &vkb_unweighted);
        *convolved = vkb_add_rows_back(&own, columns, &vkb_unweighted, &result);
        if (!levels->failed && moved && !gathers
            && !vkb_filter_to_image(adjoint, fold, *convolved, size, convolved, error))
            return false;
        if (k % 4 == 3 || k == settings->field.count - 1)
            add_weights_back(levels, gathers ? cotangents : glow, each, k - k % 4, k % 4 + 1, alpha,
                             field->places);
    }
    // What the kernels make of the image has the alpha that the bloom has.
    for (uint32_t i = first; gathers && i < adjoint->graph->pass_count; ++i)
        adjoint->graph->passes[i].constants.alpha = alpha;
    return !levels->failed;
}

bool vkb_transpose_field(struct vkb_adjoint *adjoint, const struct vkb_settings *settings,
                         const struct vkb_pass_row *pass, struct vkb_error *error)
{
    struct vkb_graph *graph = adjoint->graph;
    const uint32_t glow = vkb_find_transform(graph).reads[SLOT_SOURCE];
    const uint32_t cotangents = vkb_cotangent_of(adjoint, pass);
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

    vkb_transpose_axes(&convolution);
    const struct vkb_filter fold = fold_of(&convolution, size);
    if (adjoint->weights && fits_sums(adjoint, &settings->field, size)
        && !add_by_weights(adjoint, &passes, &field, &fold, glow, cotangents, error))
        return false;
    const uint32_t convolved = settings->field.gathers
                                 ? add_spread(&passes, &field, cotangents, &result)
                                 : add_gathered(&passes, &field, cotangents, &result);
    return !levels.failed && vkb_accumulate_filter(adjoint, &fold, convolved, glow, error);
}
