// Filters in strips and tiles, and the sum of several levels: along rows, then along columns.
#include "variants/variant.h"

#include "passes/filter.h"

#include <stdio.h>
#include <string.h>

static const struct vkb_shader *const strip_shaders[VKB_FORMAT_COUNT] =
    VKB_LINEAR_BY_FORMAT(filter);
static const struct vkb_shader *const final_shaders[VKB_FORMAT_COUNT] =
    VKB_LINEAR_BY_FORMAT(filter_final);
static const struct vkb_shader *const rows_shaders[VKB_FORMAT_COUNT] =
    VKB_LINEAR_BY_FORMAT(gather_rows);
static const struct vkb_shader *const gather_shaders[VKB_FORMAT_COUNT] =
    VKB_LINEAR_BY_FORMAT(gather_columns);

// The size of an image that is filtered along rows.
static struct vkb_size rows_size(const struct vkb_variant_choice *choice,
                                 const struct vkb_pass_row *pass, uint32_t from)
{
    return (struct vkb_size){choice->graph->images[pass->targets[0]].width,
                             choice->graph->images[from].height};
}

// Whether linear texels reach all pixels of the first `count` images that the pass reads, also
// filtered.
static bool fits_rows(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                      uint32_t count)
{
    bool fits = vkb_fits_linear(choice, pass);

    for (uint32_t i = 0; i < count; ++i) {
        const struct vkb_size size = rows_size(choice, pass, pass->reads[SLOT_LEVELS + i]);
        fits = fits
            && vkb_image_fits_linear_texels(choice->device, VKB_FORMAT_RGBA32_FLOAT, size.width,
                                            size.height);
    }
    return fits;
}

// Adds an image and the pass that filters a level along rows into it, at the positions of the
// pixels of the target of `pass`.
static uint32_t add_rows(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                         uint32_t level)
{
    const uint32_t from = pass->reads[SLOT_LEVELS + level];
    const struct vkb_size size = rows_size(choice, pass, from);
    const enum vkb_format format = choice->graph->images[from].format;
    char name[VKB_NAME_SIZE];
    struct vkb_pass_row row;

    snprintf(name, sizeof name, "%.14s_rows_%u", pass->name, level);
    memcpy(&row, pass, sizeof row);
    row.constants.levels = 0;
    memset(&row.params, 0, sizeof row.params);
    vkb_read_only(&row, from);
    row.targets[0] = vkb_add_float_image(choice, name, size);
    vkb_make_linear(&row, rows_shaders[format], GATHER_COLUMNS, GATHER_ROWS);
    vkb_add_variant_pass(choice, &row);
    return row.targets[0];
}

bool vkb_add_gathered_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    const uint32_t levels = (uint32_t)pass->constants.levels;
    struct vkb_pass_row row;

    if (!(vkb_computes(pass, VKB_BLOCK_filter) && levels && fits_rows(choice, pass, levels)))
        return false;
    const enum vkb_format format = choice->graph->images[pass->targets[0]].format;
    const bool own = pass->constants.upsample == UPSAMPLE_LINEAR
                  && vkb_same_size(&choice->plain, pass->reads[SLOT_LEVELS], pass->targets[0])
                  && vkb_has_format_of(&choice->plain, pass->reads[SLOT_LEVELS], pass->targets[0]);
    memcpy(&row, pass, sizeof row);
    row.constants.adds_image = own;
    row.constants.sampling = 0;
    for (uint32_t level = own; level < levels; ++level)
        row.reads[SLOT_LEVELS + level] = add_rows(choice, pass, level);
    vkb_make_linear(&row, gather_shaders[format], TEXEL_COLUMNS(vkb_formats[format].channel_size),
                    GATHER_ROWS);
    return vkb_add_variant_pass(choice, &row);
}

// Gives `row` the constants of the filter `pass`.
static void take_filter(const struct vkb_pass_row *pass, struct vkb_pass_row *row)
{
    const int32_t upsample = pass->constants.upsample;

    row->constants.sampling = 0;
    row->constants.upsample = upsample;
    row->constants.tap_count = pass->constants.tap_count;
    row->constants.kernels = pass->constants.kernels;
    row->constants.window = pass->constants.window;
    row->constants.taken_x = pass->constants.taken_x;
    row->constants.taken_y = pass->constants.taken_y;
    row->constants.exact = vkb_axis_ratio(&pass->filters->x);
    // The weights of others depend on how far away the edges are, too.
    if (upsample == UPSAMPLE_LINEAR || upsample == UPSAMPLE_CUBIC)
        row->constants.exact_rows = vkb_axis_ratio(&pass->filters->y);
}

// The shaders of a filter: strips by format, and tiles.
struct filter_shaders {
    const struct vkb_shader *const *strips, *tiles;
};

// Makes `row` the variant of the filter `pass`: strips on CPUs, tiles on GPUs. False: none fits.
static bool make_filter(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                        struct filter_shaders shaders, struct vkb_pass_row *row)
{
    // Its taps are in a window. Tiles of a device with little shared memory have no ratio.
    if (!vkb_is_filter(pass) || pass->constants.window == 0
        || (vkb_is_moved(pass->filters)
            && choice->device->limits.maxComputeSharedMemorySize < FILTER_TILE_SHARED))
        return false;
    const struct vkb_image_row *source = &choice->plain.images[pass->reads[SLOT_SOURCE]];
    const struct vkb_image_row *target = &choice->plain.images[pass->targets[0]];
    take_filter(pass, row);
    if (choice->variants == VKB_VARIANTS_GPU) {
        vkb_make_tiles(choice, row, shaders.tiles, pass->constants.window, pass->constants.window);
        return true;
    }
    // Of images with one format.
    if (!vkb_has_format_of(&choice->plain, pass->reads[SLOT_SOURCE], pass->targets[0])
        || (pass->constants.adds_image
            && !vkb_has_format_of(&choice->plain, pass->reads[SLOT_SAME_SIZE], pass->targets[0]))
        || !vkb_fits_linear(choice, row))
        return false;
    row->constants.enlarged = source->height <= target->height;
    vkb_make_linear(row, shaders.strips[target->format],
                    WINDOW_COLUMNS(vkb_formats[target->format].channel_size), WINDOW_ROWS);
    return true;
}

bool vkb_add_filtered_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    const struct filter_shaders shaders = {strip_shaders, &vkb_shader_filter_tile_comp};
    struct vkb_pass_row row;

    memcpy(&row, pass, sizeof row);
    return make_filter(choice, pass, shaders, &row) && vkb_add_variant_pass(choice, &row)
        && vkb_add_from_image_variant(choice, pass, &row);
}

// The filter that makes the bloom which `pass` ends, if a fused pass may nest it; NULL: none.
static const struct vkb_pass_row *nested_filter(const struct vkb_variant_choice *choice,
                                                const struct vkb_pass_row *pass)
{
    const struct vkb_graph *plain = &choice->plain;
    const struct vkb_pass_row *up = vkb_bloom_of(plain, pass);
    const uint32_t target = pass->targets[0];

    // The shaders are compiled for one format. The levels of a published method may have their own.
    return up && vkb_is_filter(up) && !pass->constants.masked && !pass->transposed
                && vkb_has_format_of(plain, up->reads[SLOT_SOURCE], target)
                && vkb_has_format_of(plain, pass->reads[SLOT_SCENE], target)
                && plain->images[pass->reads[SLOT_BLOOM]].format == plain->images[target].format
                && vkb_same_size(plain, pass->reads[SLOT_BLOOM], target)
             ? up
             : NULL;
}

VKB_COPY_FUNCTION(copy_filter, filter_final, filter,
                  SAMPLING_ROWS(filter_final, VKB_COPY_INPUT)
                      FILTER_ROWS(filter_final, VKB_COPY_INPUT, VKB_COPY_VEC4S))
VKB_COPY_FUNCTION(copy_composite, filter_final, composite,
                  COMPOSITE_ROWS(filter_final, VKB_COPY_READS, VKB_COPY_INPUT))

// The row of this pass, without a shader.
static struct vkb_pass_row nested_row(const struct vkb_variant_choice *choice,
                                      const struct vkb_pass_row *pass,
                                      const struct vkb_pass_row *up)
{
    const enum vkb_format format = choice->plain.images[pass->reads[SLOT_BLOOM]].format;
    struct vkb_pass_row row;

    memcpy(&row, pass, sizeof row);
    memset(&row.params, 0, sizeof row.params);
    row.fused = true;
    vkb_read_only(&row, up->reads[SLOT_SOURCE]);
    row.constants.adds_image = up->constants.adds_image;
    vkb_read_at(&row, SLOT_SAME_SIZE,
                up->constants.adds_image ? up->reads[SLOT_SAME_SIZE] : VKB_NO_IMAGE);
    vkb_read_at(&row, SLOT_ENDED, pass->reads[SLOT_SCENE]);
    row.block = VKB_BLOCK_filter_final;
    copy_filter(&row.params.filter_final, &up->params.filter);
    copy_composite(&row.params.filter_final, &pass->params.composite);
    row.constants.format = vkb_storage_mode(format);
    return row;
}

// Adds the composite, and after it a fused pass that also filters the last level.
bool vkb_add_filtered_final_variant(struct vkb_variant_choice *choice,
                                    const struct vkb_pass_row *pass)
{
    const struct vkb_pass_row *up = nested_filter(choice, pass);
    const struct filter_shaders shaders = {final_shaders, &vkb_shader_filter_tile_final_comp};
    struct vkb_pass_row row;

    if (!up)
        return false;
    row = nested_row(choice, pass, up);
    return make_filter(choice, up, shaders, &row) && vkb_add_fullscreen_variant(choice, pass)
        && vkb_add_variant_pass(choice, &row);
}
