// Variants of adjoint passes: transposed filters in blocks of texels and in tiles.
#include "variants/variant.h"

#include "passes/taps.h"

#include <math.h>
#include <string.h>

// The entries of an axis in the table of weights (passes/taps.h).
struct axis {
    const float (*entries)[4];
    uint32_t size;
};

static struct axis axis_of(const struct vkb_graph *graph, const struct vkb_pass_row *pass,
                           bool vertical)
{
    const struct vkb_adjoint_filter_params *params = &pass->params.adjoint_filter;
    const struct vkb_image_row *target = &graph->images[pass->targets[0]];
    const float (*texels)[4] = graph->images[pass->reads[1]].pixels;

    return (struct axis){
        .entries = texels + (vertical ? params->start_y : params->start_x),
        .size = vertical ? target->height : target->width,
    };
}

static const float *entry_of(const struct axis *axis, uint32_t texel)
{
    const uint32_t last = axis->size - 1;

    return axis->entries[texel < last ? texel : last];
}

// The most weights of columns that an invocation keeps: the driver compiles a load of each.
enum { MAX_LINEAR = 128 };

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
    const float intensity = pass->constants.lit ? 1.0f : params->intensity;
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
    const struct vkb_adjoint_filter_params *params = &pass->params.adjoint_filter;
    struct vkb_pass_row row;

    if (!(pass->block == VKB_BLOCK_adjoint_filter
          && pass->constants.levels * params->span_x <= MAX_LINEAR && vkb_are_floats(choice, pass)))
        return false;
    memcpy(&row, pass, sizeof row);
    row.constants.radix_1 = params->span_x;
    row.constants.radix_2 = params->span_y;
    row.gains_if_finite = true;
    read_linear_of_composite(choice, &row);
    vkb_make_linear(&row, &vkb_shader_adjoint_taps_linear_rgba32float, ADJOINT_SIDE, ADJOINT_ROWS);
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
    if (other && vertical)
        row->params.adjoint_filter.start_x = other->params.adjoint_filter.start_x;
    else if (other)
        row->params.adjoint_filter.start_y = other->params.adjoint_filter.start_y;
    row->params.adjoint_filter.gain *= other ? other->params.adjoint_filter.gain : 1.0f;
    row->constants.direction = 0;
    row->constants.kernels = pass->constants.levels;
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
