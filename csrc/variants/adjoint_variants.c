// Variants of adjoint passes: transposed filters in blocks of texels and in tiles.
#include "variants/variant.h"

#include "passes/taps.h"

#include <math.h>
#include <string.h>

// An axis in the table of weights (passes/taps.h): its entries, and the kernels of a texel of
// weights, 0 for one whose weights are packed.
struct axis {
    const float (*texels)[4];
    uint32_t start, size;
    int32_t kernels;
};

static struct axis axis_of(const struct vkb_graph *graph, const struct vkb_pass_row *pass,
                           bool vertical)
{
    const struct vkb_adjoint_filter_params *params = &pass->params.adjoint_filter;
    const struct vkb_image_row *target = &graph->images[pass->targets[0]];

    return (struct axis){
        .texels = graph->images[pass->reads[1]].pixels,
        .start = (uint32_t)(vertical ? params->start_y : params->start_x),
        .size = vertical ? target->height : target->width,
        .kernels = pass->constants.levels,
    };
}

static const float *entry_of(const struct axis *axis, uint32_t texel)
{
    const uint32_t last = axis->size - 1;

    return axis->texels[axis->start + (texel < last ? texel : last)];
}

static float weight_of(const struct axis *axis, uint32_t texel, uint32_t pixel, uint32_t kernel)
{
    const float *entry = entry_of(axis, texel);
    const uint32_t first = (uint32_t)entry[0], place = (uint32_t)entry[2];
    const uint32_t reader = pixel - first;

    if (texel >= axis->size || pixel < first || reader >= (uint32_t)entry[1])
        return 0.0f;
    return axis->kernels ? axis->texels[place + reader][kernel]
                         : axis->texels[place + reader / 4][reader % 4];
}

// The number of pixels that read the texels of a block, of which *first is the first one. Those of
// an axis that is mirrored come in the opposite order.
static uint32_t readers_of(const struct axis *axis, uint32_t texel, uint32_t *first)
{
    float low = entry_of(axis, texel)[0], high = 0.0f;

    for (uint32_t i = 0; i < ADJOINT_SIDE; ++i) {
        const float *entry = entry_of(axis, texel + i);
        low = fminf(low, entry[0]);
        high = fmaxf(high, entry[0] + entry[1]);
    }
    *first = (uint32_t)low;
    return (uint32_t)(high - low);
}

// The most pixels that read a block of texels.
static uint32_t span_of(const struct axis *axis)
{
    uint32_t most = 1, first;

    for (uint32_t texel = 0; texel < axis->size; texel += ADJOINT_SIDE) {
        const uint32_t span = readers_of(axis, texel, &first);
        most = span > most ? span : most;
    }
    return most;
}

// Adds the entries of an axis, and a list of weights for each that differs from the one before.
static bool add_blocks(const struct axis *axis, uint32_t span, struct vkb_table *to,
                       uint32_t *start, struct vkb_error *error)
{
    const uint32_t blocks = (axis->size + ADJOINT_SIDE - 1) / ADJOINT_SIDE;
    const uint32_t kernels = axis->kernels ? (uint32_t)axis->kernels : 1, list = span * kernels;
    size_t before = 0;

    *start = (uint32_t)to->count;
    if (!vkb_grow(error, &to->texels, &to->capacity, to->count + blocks, sizeof *to->texels))
        return false;
    to->count += blocks;
    for (uint32_t block = 0; block < blocks; ++block) {
        uint32_t first;
        readers_of(axis, block * ADJOINT_SIDE, &first);
        if (!vkb_grow(error, &to->texels, &to->capacity, to->count + list, sizeof *to->texels))
            return false;
        for (uint32_t i = 0; i < list; ++i)
            for (uint32_t k = 0; k < ADJOINT_SIDE; ++k)
                to->texels[to->count + i][k] =
                    weight_of(axis, block * ADJOINT_SIDE + k, first + i / kernels, i % kernels);
        const bool same =
            before
            && memcmp(to->texels[before], to->texels[to->count], list * sizeof *to->texels) == 0;
        before = same ? before : to->count;
        to->count += same ? 0 : list;
        const float entry[4] = {(float)first, 0.0f, (float)before, 0.0f};
        memcpy(to->texels[*start + block], entry, sizeof entry);
    }
    return true;
}

// Adds tables of blocks for the axes of a filter.
static bool add_tables(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                       struct vkb_pass_row *row, struct vkb_error *error)
{
    struct vkb_graph *graph = choice->graph;
    const struct vkb_image_row *image = &graph->images[pass->reads[1]];
    const struct axis x = axis_of(graph, pass, false), y = axis_of(graph, pass, true);
    const size_t texels = (size_t)image->width * image->height;
    const enum vkb_mode direction = (enum vkb_mode)pass->constants.direction;
    struct vkb_table table = {0};
    uint32_t start_x = 0, start_y = 0;

    bool done = vkb_grow(error, &table.texels, &table.capacity, texels, sizeof *table.texels);
    if (done)
        memcpy(table.texels, image->pixels, texels * sizeof *table.texels);
    table.count = texels;
    if (done && direction != DIRECTION_VERTICAL) {
        const uint32_t span = span_of(&x);
        row->constants.radix_1 = (int32_t)span - 1;
        done = add_blocks(&x, span, &table, &start_x, error);
    }
    if (done && direction != DIRECTION_HORIZONTAL) {
        const uint32_t span = span_of(&y);
        row->constants.radix_2 = (int32_t)span - 1;
        done = add_blocks(&y, span, &table, &start_y, error);
    }
    if (!done) {
        vkb_free(table.texels);
        return false;
    }
    row->params.adjoint_filter.start_x = (int32_t)start_x;
    row->params.adjoint_filter.start_y = (int32_t)start_y;
    return vkb_table_end(&table, graph, pass->reads[1], error);
}

// The most weights that an invocation keeps along an axis, in vec4s. More than there are registers
// for LLVM would be slower than the plain pass.
enum { MAX_LINEAR = 24 };

static bool fits_lists(const struct vkb_graph *graph, const struct vkb_pass_row *pass)
{
    const struct axis x = axis_of(graph, pass, false), y = axis_of(graph, pass, true);
    const enum vkb_mode direction = (enum vkb_mode)pass->constants.direction;
    const uint32_t kernels = x.kernels ? (uint32_t)x.kernels : 1;

    return (direction == DIRECTION_VERTICAL || kernels * span_of(&x) <= MAX_LINEAR)
        && (direction == DIRECTION_HORIZONTAL || kernels * span_of(&y) <= MAX_LINEAR);
}

bool vkb_are_floats(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    bool fits = vkb_fits_linear(choice, pass);

    for (uint32_t i = 0; i < pass->read_count; ++i)
        fits = fits && choice->graph->images[pass->reads[i]].format == VKB_FORMAT_RGBA32_FLOAT;
    return fits;
}

bool vkb_is_factor(const struct vkb_pass_row *pass)
{
    return vkb_transposes(pass, VKB_BLOCK_composite) && !pass->constants.masked
        && pass->constants.by == BY_BLOOM && !pass->constants.add_own && !pass->constants.from_image
        && pass->reads[0] == pass->reads[1]
        && (pass->constants.composite == COMPOSITE_ADD
            || pass->constants.composite == COMPOSITE_MIX);
}

// Also in place of images that the row does not read.
static void replace_read(struct vkb_pass_row *row, uint32_t from, uint32_t to)
{
    for (uint32_t i = 0; i < row->read_count; ++i)
        row->reads[i] = row->reads[i] == from ? to : row->reads[i];
}

// Reads the cotangents of a composite without a curve in place of those of its bloom.
static void read_composite(const struct vkb_graph *graph, struct vkb_pass_row *row)
{
    const uint32_t by_bloom = row->reads[0];
    const struct vkb_pass_row *pass = vkb_writer_of(graph, by_bloom);

    if (!pass || !vkb_is_factor(pass))
        return;
    const struct vkb_composite_params *params = &pass->params.composite;
    const float intensity = pass->constants.bloom == BLOOM_LIT ? 1.0f : params->intensity;
    row->params.adjoint_filter.gain *= intensity * exp2f(params->exposure);
    row->constants.by = BY_BLOOM;
    replace_read(row, by_bloom, pass->reads[3]);
    row->reads[2] = pass->reads[0];
}

// The same, if its images have linear texels, too.
static void read_linear_of_composite(const struct vkb_variant_choice *choice,
                                     struct vkb_pass_row *row)
{
    struct vkb_pass_row fused;

    memcpy(&fused, row, sizeof fused);
    read_composite(&choice->plain, &fused);
    if (vkb_are_floats(choice, &fused))
        memcpy(row, &fused, sizeof fused);
}

bool vkb_add_adjoint_linear(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    struct vkb_pass_row row;

    if (!(pass->block == VKB_BLOCK_adjoint_filter && fits_lists(choice->graph, pass)
          && vkb_are_floats(choice, pass)))
        return false;
    memcpy(&row, pass, sizeof row);
    row.gains_if_finite = true;
    read_linear_of_composite(choice, &row);
    vkb_make_linear(&row, &vkb_shader_adjoint_taps_linear_rgba32float, ADJOINT_SIDE, ADJOINT_ROWS);
    choice->failed = choice->failed || !add_tables(choice, pass, &row, choice->error);
    return vkb_add_variant(choice, &row);
}

// An invocation for all groups of a pixel, which fragments would compute anew for each.
bool vkb_add_adjoint_groups(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    struct vkb_pass_row row;

    if (!(vkb_transposes(pass, VKB_BLOCK_prefilter) && pass->constants.radix_1 > 1))
        return false;
    memcpy(&row, pass, sizeof row);
    vkb_make_dispatch(&row, pass->shader->dispatch, PIXEL_INVOCATIONS, PIXEL_INVOCATIONS);
    // Those of one picture, since llvmpipe also runs what an early end leaves out.
    const struct vkb_image_row *target = &choice->graph->images[row.targets[0]];
    const uint32_t height = target->height / (uint32_t)row.constants.radix_1;
    row.groups_width = (target->width + PIXEL_INVOCATIONS - 1) / PIXEL_INVOCATIONS;
    row.groups_height = (height + PIXEL_INVOCATIONS - 1) / PIXEL_INVOCATIONS;
    return vkb_add_variant(choice, &row);
}

static uint32_t readers_of_image(const struct vkb_graph *graph, uint32_t image)
{
    uint32_t readers = 0;

    for (uint32_t i = 0; i < graph->pass_count; ++i)
        readers += graph->passes[i].block == VKB_BLOCK_adjoint_filter
                && graph->passes[i].reads[0] == image;
    return readers;
}

// The pass along the other axis that only this one reads; NULL: there is none.
static const struct vkb_pass_row *other_axis(const struct vkb_graph *graph,
                                             const struct vkb_pass_row *pass)
{
    const struct vkb_pass_row *first = vkb_writer_of(graph, pass->reads[0]);

    return pass->constants.direction != DIRECTION_BOTH && first
                && first->block == VKB_BLOCK_adjoint_filter && !first->constants.add_own
                && !first->constants.from_image
                && first->constants.direction == !pass->constants.direction
                && readers_of_image(graph, pass->reads[0]) == 1
             ? first
             : NULL;
}

// The texel of the source at or before the position of a texel of the target.
static int32_t texel_before(int32_t ratio, int32_t texel)
{
    return ratio == EXACT_HALF ? 2 * texel : ratio == EXACT_SAME ? texel : (texel + 1) / 2 - 1;
}

// The most readers of a texel.
static int32_t most_readers(const struct axis *axis)
{
    int32_t most = 1;

    for (uint32_t texel = 0; texel < axis->size; ++texel)
        most = (int32_t)fmaxf((float)most, entry_of(axis, texel)[1]);
    return most;
}

// The most readers before or after the middle of the window that a filter in this ratio has.
static int32_t most_beside(const struct axis *axis, int32_t ratio)
{
    int32_t most = 1;

    for (uint32_t texel = 0; texel < axis->size; ++texel) {
        const float *entry = entry_of(axis, texel);
        const int32_t before = texel_before(ratio, (int32_t)texel) - (int32_t)entry[0] + 1;
        const int32_t after = (int32_t)entry[1] - before;
        most = most > before ? most : before;
        most = most > after ? most : after;
    }
    return most;
}

// Gives `row` the windows of both axes, which begin at the first reader or, where the ratio is
// simple, as those of a filter. Columns share texels if both ratios are simple.
static void set_windows(const struct axis *x, const struct axis *y, int32_t ratio_x,
                        int32_t ratio_y, struct vkb_pass_row *row)
{
    struct vkb_constants *constants = &row->constants;
    const int32_t rows = ratio_y ? 2 * most_beside(y, ratio_y) : MAX_WINDOW + 1;
    const int32_t columns = ratio_x ? 2 * most_beside(x, ratio_x) : MAX_WINDOW + 1;

    constants->exact_rows = rows <= MAX_WINDOW ? ratio_y : 0;
    constants->exact = constants->exact_rows && columns <= MAX_WINDOW ? ratio_x : 0;
    const int32_t of_rows = constants->exact_rows ? rows : most_readers(y);
    const int32_t of_columns = constants->exact ? columns : most_readers(x);
    constants->window = of_columns > of_rows ? of_columns : of_rows;
    constants->taken_x = constants->taken_y = 0;
    for (int32_t kernel = 0;
         !constants->exact && of_columns < constants->window && kernel < constants->kernels;
         ++kernel)
        constants->taken_x |= ((1 << of_columns) - 1) << MAX_WINDOW * kernel;
}

// The most rows that a tile reads; 0: the readers of a row begin above those of the row before.
static uint32_t tile_rows(const struct axis *y, const struct vkb_constants *constants)
{
    const int32_t ratio = constants->exact_rows;
    int32_t most = 0;

    for (uint32_t texel = 0; texel + 1 < y->size && !ratio; ++texel)
        if (entry_of(y, texel)[0] > entry_of(y, texel + 1)[0])
            return 0;
    for (uint32_t texel = 0; texel < y->size; texel += FILTER_TILE_ROWS) {
        const uint32_t last = texel + FILTER_TILE_ROWS - 1;
        const int32_t rows =
            ratio ? texel_before(ratio, (int32_t)last) - texel_before(ratio, (int32_t)texel)
                  : (int32_t)(entry_of(y, last)[0] - entry_of(y, texel)[0]);
        most = rows > most ? rows : most;
    }
    return (uint32_t)(most + constants->window);
}

// Makes `row` tiles along both axes at once, also where the plain passes are one for each axis, of
// which `pass` is the last one. False: few readers at positions that differ from row to row, most
// of which are in a cache, or windows that are too large.
static bool make_tiles(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                       struct vkb_pass_row *row)
{
    const struct vkb_graph *graph = choice->graph;
    const struct vkb_pass_row *other = other_axis(&choice->plain, pass);
    const bool vertical = pass->constants.direction == DIRECTION_VERTICAL;

    if (!other && pass->constants.direction != DIRECTION_BOTH)
        return false;
    const struct axis x = axis_of(graph, other && vertical ? other : pass, false);
    const struct axis y = axis_of(graph, other && !vertical ? other : pass, true);
    if (other)
        replace_read(row, pass->reads[0], other->reads[0]);
    row->params.adjoint_filter.start_x = (int32_t)x.start;
    row->params.adjoint_filter.start_y = (int32_t)y.start;
    row->params.adjoint_filter.gain *= other ? other->params.adjoint_filter.gain : 1.0f;
    row->constants.direction = 0;
    row->constants.kernels = pass->constants.levels ? pass->constants.levels : 1;
    const struct vkb_image_row *source = &graph->images[row->reads[0]];
    const int32_t ratio_x = vkb_ratio_of(source->width, x.size);
    const int32_t ratio_y = vkb_ratio_of(source->height, y.size);
    if (!other && !ratio_y && pass->constants.levels < 2)
        return false;
    set_windows(&x, &y, ratio_x, ratio_y, row);
    const uint32_t source_rows = tile_rows(&y, &row->constants);
    return row->constants.window <= MAX_WINDOW && source_rows > 0
        && vkb_make_tiles(choice, &vkb_shader_adjoint_filter_tile_comp, source_rows, row);
}

bool vkb_add_adjoint_filter(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    struct vkb_pass_row row, tiles;

    if (pass->block != VKB_BLOCK_adjoint_filter)
        return false;
    memcpy(&row, pass, sizeof row);
    row.gains_if_finite = true;
    memcpy(&tiles, &row, sizeof tiles);
    const bool fits_tiles = make_tiles(choice, pass, &tiles);
    read_composite(&choice->plain, fits_tiles ? &tiles : &row);
    return fits_tiles ? vkb_add_variant(choice, &tiles) : vkb_add_fullscreen(choice, &row);
}
