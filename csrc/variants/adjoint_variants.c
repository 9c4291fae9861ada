// Variants of adjoint passes: transposed filters in blocks of texels, in tiles and in lines.
#include "variants/variant.h"

#include "passes/taps.h"

#include <string.h>

// The most weights of columns that an invocation keeps: the driver compiles a load of each.
enum { MAX_LINEAR = 128 };
// The most pixels that read a texel in tiles along both axes without sums of rows.
enum { MAX_WITHOUT_SUMS = 64 };

bool vkb_are_floats(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    bool fits = vkb_fits_linear(choice, pass);

    for (uint32_t i = 0; i < pass->read_count; ++i) {
        const enum vkb_format format =
            i == SLOT_MASK ? VKB_FORMAT_R32_FLOAT : VKB_FORMAT_RGBA32_FLOAT;
        fits = fits
            && (pass->reads[i] == VKB_NO_IMAGE
                || choice->graph->images[pass->reads[i]].format == format);
    }
    return fits;
}

// Has a filter read the cotangents of a composite in place of those of its bloom.
static void read_composite(const struct vkb_graph *graph, struct vkb_pass_row *row)
{
    row->params.adjoint_filter.gain *= vkb_read_composite(graph, SLOT_COTANGENTS, SLOT_SCENE, row);
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

static bool is_kept(const struct vkb_readers *readers)
{
    return readers->start < 0;
}

// The readers of an axis that a pass in this direction has: none, if it keeps the axis.
static const struct vkb_readers *readers_along(const struct vkb_axis *axis, bool vertical,
                                               int32_t direction)
{
    return direction == (vertical ? DIRECTION_HORIZONTAL : DIRECTION_VERTICAL) ? &vkb_kept_readers
                                                                               : &axis->readers;
}

bool vkb_add_adjoint_linear_variant(struct vkb_variant_choice *choice,
                                    const struct vkb_pass_row *pass)
{
    struct vkb_pass_row row;

    if (pass->block != VKB_BLOCK_adjoint_filter)
        return false;
    const struct vkb_filter *filter = pass->filters;
    const int32_t direction = pass->constants.direction;
    const int32_t span_x = readers_along(&filter->x, false, direction)->span;
    const int32_t span_y = readers_along(&filter->y, true, direction)->span;
    if (span_x == 0 || span_y == 0 || (int32_t)filter->kernels * span_x > MAX_LINEAR
        || !vkb_are_floats(choice, pass))
        return false;
    memcpy(&row, pass, sizeof row);
    row.constants.span_width = span_x;
    row.constants.span_height = span_y;
    row.gains_if_finite = true;
    read_linear_of_composite(choice, &row);
    vkb_make_linear(&row, &vkb_shader_adjoint_taps_linear_rgba32float, ADJOINT_SIDE, ADJOINT_ROWS);
    return vkb_add_variant_pass(choice, &row);
}

// An invocation for all kernels of a pixel, which fragments would compute anew for each.
static bool add_kernels(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    struct vkb_pass_row row;

    memcpy(&row, pass, sizeof row);
    vkb_make_dispatch(&row, pass->shader->dispatch, PIXEL_INVOCATIONS, PIXEL_INVOCATIONS);
    // Those of one picture, since llvmpipe also runs what an early end leaves out.
    const struct vkb_image_row *target = &choice->graph->images[row.targets[0]];
    const uint32_t height = target->height / (uint32_t)row.constants.stacked_samples;
    row.groups_width = (target->width + PIXEL_INVOCATIONS - 1) / PIXEL_INVOCATIONS;
    row.groups_height = (height + PIXEL_INVOCATIONS - 1) / PIXEL_INVOCATIONS;
    return vkb_add_variant_pass(choice, &row);
}

bool vkb_add_adjoint_first_variant(struct vkb_variant_choice *choice,
                                   const struct vkb_pass_row *pass)
{
    struct vkb_pass_row row;

    if (pass->shader != &vkb_shader_adjoint_prefilter_frag
        && pass->shader != &vkb_shader_adjoint_bright_frag)
        return false;
    (pass->constants.stacked_samples > 1 ? add_kernels : vkb_add_fullscreen_variant)(choice, pass);
    if (choice->failed)
        return true;
    memcpy(&row, &choice->graph->passes[choice->graph->pass_count - 1], sizeof row);
    return vkb_add_from_image_variant(choice, pass, &row);
}

bool vkb_add_adjoint_end_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    struct vkb_pass_row row;

    if (!vkb_transposes(pass, VKB_BLOCK_blender_end))
        return false;
    memcpy(&row, pass, sizeof row);
    row.gains_if_finite = true;
    const float gain = vkb_read_composite(&choice->plain, SLOT_COTANGENTS, SLOT_ENDED, &row);
    for (int channel = 0; channel < 4; ++channel)
        row.params.blender_end.factors[0][channel] *= gain;
    return vkb_add_fullscreen_variant(choice, &row);
}

// The transpose of a filter in tiles: windows along both axes, the sizes of the images' ratios, and
// whether tiles keep the sums of rows.
struct tiles {
    const struct vkb_readers *x, *y;
    int32_t width, height, exact_x, exact_y;
    bool keeps;
};

// A filter of one row, or of both rows along one axis each, and the image that it reads.
struct part {
    const struct vkb_filter *filter;
    int32_t direction;
    uint32_t from;
};

static struct part own_part(const struct vkb_pass_row *pass)
{
    return (struct part){pass->filters, pass->constants.direction, pass->reads[SLOT_COTANGENTS]};
}

// What a pass adds: with the row before it, along the other axis, if few pixels read a texel.
static struct part part_of(const struct vkb_pass_row *pass)
{
    const struct vkb_filter *joined = pass->joined_count == 1 ? pass->joined : NULL;

    return joined && joined->x.readers.most <= MAX_WINDOW && joined->y.readers.most <= MAX_WINDOW
             ? (struct part){joined, DIRECTION_BOTH, pass->joined_from}
             : own_part(pass);
}

// The ratio of a side of the image that is read to the side of an axis, if its windows have it.
static int32_t ratio_along(const struct vkb_axis *axis, const struct vkb_readers *readers,
                           uint32_t side)
{
    const int32_t ratio = vkb_ratio_of(side, axis->from);

    return is_kept(readers)                                                   ? EXACT_SAME
         : readers->window > 0 && ratio == vkb_ratio_of(axis->to, axis->from) ? ratio
                                                                              : 0;
}

// Finds the tiles of a filter. False: few readers at positions that differ from row to row, most of
// which are in a cache, or windows that are too large.
static bool find_tiles(const struct vkb_variant_choice *choice, const struct part *part,
                       struct tiles *tiles)
{
    const struct vkb_filter *filter = part->filter;
    const struct vkb_readers *x = readers_along(&filter->x, false, part->direction);
    const struct vkb_readers *y = readers_along(&filter->y, true, part->direction);
    const struct vkb_image_row *source = &choice->graph->images[part->from];
    const bool has_shared = choice->device->limits.maxComputeSharedMemorySize >= FILTER_TILE_SHARED;
    int32_t exact_x = ratio_along(&filter->x, x, source->width);
    int32_t exact_y = ratio_along(&filter->y, y, source->height);

    *tiles = (struct tiles){.x = x, .y = y, .width = x->most, .height = y->most};
    if (x->most > MAX_READERS || y->most > MAX_READERS
        || (filter->kernels == 1 && !vkb_ratio_of(source->height, filter->y.from) && !is_kept(x)
            && !is_kept(y)))
        return false;
    if (filter->kernels > 1 || !has_shared || !exact_x || !exact_y)
        return true;
    tiles->width = x->window;
    tiles->height = y->window;
    tiles->keeps = FILTER_TILE_KEEPS(exact_x, filter->kernels, x->window, y->window) && x->repeats
                && y->repeats;
    // Loops of constant length are slower where they are long: 960 x 540 pixels that 20 x 2 ones
    // read 0.123 ms, 0.094 otherwise (H100, 2026-11-27).
    if (!tiles->keeps && x->window > 1 && y->window > 1)
        exact_x = exact_y = 0;
    tiles->exact_x = exact_x;
    tiles->exact_y = exact_y;
    return true;
}

// Turns a row into its tiles.
static void set_tiles(const struct vkb_variant_choice *choice, const struct tiles *tiles,
                      struct vkb_pass_row *row)
{
    struct vkb_adjoint_filter_params *params = &row->params.adjoint_filter;
    const struct vkb_shader *shader = &vkb_shader_adjoint_filter_tile_comp;

    params->pictures[0][0] = (float)tiles->x->start;
    params->pictures[0][1] = (float)tiles->y->start;
    if (!tiles->keeps) {
        row->constants.exact = tiles->exact_x;
        row->constants.exact_rows = tiles->exact_y;
        vkb_make_tiles(choice, row, shader, tiles->width, tiles->height);
        return;
    }
    // Such tiles are turned: they load columns, and x and y change places.
    memcpy(params->inner_x, tiles->x->inner, sizeof params->inner_x);
    memcpy(params->inner_y, tiles->y->inner, sizeof params->inner_y);
    row->constants.exact = tiles->exact_y;
    row->constants.exact_rows = tiles->exact_x;
    vkb_make_tiles(choice, row, shader, tiles->height, tiles->width);
    row->block_width = row->block_height;
    row->block_height = FILTER_TILE_COLUMNS;
}

// Makes `row` tiles, along both axes at once also where the plain passes are one for each axis, of
// which `pass` is the last one. False: they do not suit it.
static bool make_tiles(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                       struct vkb_pass_row *row)
{
    struct part part = part_of(pass);
    struct tiles tiles;

    if (!find_tiles(choice, &part, &tiles))
        return false;
    // Tiles that keep no sums of rows take the product of both windows: 0.9 ms for 3840 x 2160
    // pixels that 10 x 10 ones read, and 0.47 along one axis after the other (H200, 2026-11-30).
    if (part.filter == pass->joined && !tiles.keeps
        && tiles.width * tiles.height > MAX_WITHOUT_SUMS) {
        part = own_part(pass);
        if (!find_tiles(choice, &part, &tiles))
            return false;
    }
    row->reads[SLOT_COTANGENTS] = part.from;
    set_tiles(choice, &tiles, row);
    return true;
}

// Whether a workgroup can hold the windows of all its columns and rows in so many pictures: the
// first texels and the weights, which are one more than `side`.
static bool holds_windows(const struct vkb_variant_choice *choice, uint32_t pictures, int32_t side)
{
    const size_t windows =
        pictures * (FILTER_TILE_COLUMNS + (size_t)FILTER_TILE_RUN * FILTER_TILE_RUNS);
    // The rest of the shared memory of tiles without sums.
    const size_t rest = 4 * sizeof(float) * (FILTER_TILE_COLUMNS + 2);

    return windows * (size_t)(side + 2) * sizeof(float) + rest
        <= choice->device->limits.maxComputeSharedMemorySize;
}

// After the last one of several passes that add up the pictures of one image, adds a fused pass.
static bool add_pictures(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    const struct vkb_pass_row *first = pass + 1 - pass->joined_count;
    struct vkb_pass_row row;
    int32_t width = 1, height = 1, inner = 1;

    if (pass->joined_count < 2)
        return true;
    memcpy(&row, pass, sizeof row);
    row.fused = row.gains_if_finite = true;
    row.reads[SLOT_ADDED] = first->reads[SLOT_ADDED];
    row.reads[SLOT_MASK] = first->reads[SLOT_MASK];
    row.constants.adds_image = first->constants.adds_image;
    row.constants.masked = first->constants.masked;
    row.params.adjoint_filter.share = first->params.adjoint_filter.share;
    row.params.adjoint_filter.share_of_mask = first->params.adjoint_filter.share_of_mask;
    for (uint32_t i = 0; i < pass->joined_count; ++i) {
        const struct vkb_readers *x = &pass->joined[i].x.readers, *y = &pass->joined[i].y.readers;
        width = x->most > width ? x->most : width;
        height = y->most > height ? y->most : height;
        inner = x->usual > inner ? x->usual : inner;
        inner = y->usual > inner ? y->usual : inner;
        row.params.adjoint_filter.pictures[i][0] = (float)x->start;
        row.params.adjoint_filter.pictures[i][1] = (float)y->start;
    }
    vkb_make_tiles(choice, &row, &vkb_shader_adjoint_filter_tile_comp, width, height);
    row.constants.pictures = (int32_t)pass->joined_count;
    row.constants.inner = inner;
    return width > MAX_WINDOW || height > MAX_WINDOW
        || !holds_windows(choice, pass->joined_count, width > height ? width : height)
        || vkb_add_variant_pass(choice, &row);
}

// Makes `row` blocks of texels along its only axis. False: it has two, or several kernels, or
// blocks that differ, or so many weights that a workgroup cannot hold them.
static bool make_lines(const struct vkb_variant_choice *choice, struct vkb_pass_row *row)
{
    const bool along_x = row->constants.direction == DIRECTION_HORIZONTAL;
    const struct vkb_filter *filter = row->filters;
    const int32_t span = along_x ? filter->x.readers.span : filter->y.readers.span;

    if (row->constants.direction == DIRECTION_BOTH || row->constants.kernels > 1 || span == 0
        || 4 * sizeof(float) * ((size_t)span + ADJOINT_SIDE)
               > choice->device->limits.maxComputeSharedMemorySize)
        return false;
    row->constants.span_width = span;
    vkb_make_dispatch(row, &vkb_shader_adjoint_line_comp,
                      PIXEL_INVOCATIONS * (along_x ? ADJOINT_SIDE : 1),
                      PIXEL_INVOCATIONS * (along_x ? 1 : ADJOINT_SIDE));
    return true;
}

bool vkb_add_adjoint_filter_variant(struct vkb_variant_choice *choice,
                                    const struct vkb_pass_row *pass)
{
    struct vkb_pass_row row;

    if (pass->block != VKB_BLOCK_adjoint_filter)
        return false;
    memcpy(&row, pass, sizeof row);
    row.gains_if_finite = true;
    const bool in_blocks = make_tiles(choice, pass, &row) || make_lines(choice, &row);
    read_composite(&choice->plain, &row);
    return (in_blocks ? vkb_add_variant_pass(choice, &row)
                      : vkb_add_fullscreen_variant(choice, &row))
        && add_pictures(choice, pass) && vkb_add_ended_lines_variant(choice, pass);
}
