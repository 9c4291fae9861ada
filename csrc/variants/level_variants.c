// Variants of downsampling, and of the first passes of published methods.
#include "variants/variant.h"

#include "passes/filter.h"
#include "passes/tap_sets.h"

#include <string.h>

static const struct vkb_shader *const taps_linear[VKB_FORMAT_COUNT] = VKB_LINEAR_BY_FORMAT(taps);
static const struct vkb_shader *const rows_linear[VKB_FORMAT_COUNT] =
    VKB_LINEAR_BY_FORMAT(nine_rows);
static const struct vkb_shader *const columns_linear[VKB_FORMAT_COUNT] =
    VKB_LINEAR_BY_FORMAT(nine_columns);

// Whether the pass can be one of linear texels, whose shaders are compiled for one format of all
// images.
static bool loads(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    return vkb_fits_linear(choice, pass)
        && vkb_has_format_of(&choice->plain, pass->reads[SLOT_SOURCE], pass->targets[0]);
}

// The simple ratio of both sides of the source and the target, of EXACT_*; 0: they have none.
static int32_t ratio_of(const struct vkb_graph *graph, const struct vkb_pass_row *pass)
{
    const struct vkb_image_row *source = &graph->images[pass->reads[SLOT_SOURCE]];
    const struct vkb_image_row *target = &graph->images[pass->targets[0]];
    const int32_t ratio = vkb_ratio_of(source->height, target->height);

    return ratio == vkb_ratio_of(source->width, target->width) ? ratio : 0;
}

// Makes the pass one of linear texels, which loads the texels of its first image.
static void make_linear(struct vkb_pass_row *row, const struct vkb_shader *shader, uint32_t columns,
                        uint32_t rows)
{
    row->constants.sampling = 0;
    vkb_read_only(row, row->reads[SLOT_SOURCE]);
    vkb_make_linear(row, shader, columns, rows);
}

bool vkb_add_windowed_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    const int32_t set = pass->constants.tap_set;
    struct vkb_pass_row row;

    // Variants keep the texels around a position: a block is of others.
    if (!vkb_computes(pass, VKB_BLOCK_prefilter) || vkb_is_line_set(set)
        || pass->constants.mean_side || pass->constants.masked
        || pass->params.prefilter.step_x != 1.0f || pass->params.prefilter.step_y != 1.0f)
        return false;
    const struct vkb_image_row *source = &choice->plain.images[pass->reads[SLOT_SOURCE]];
    const struct vkb_image_row *target = &choice->plain.images[pass->targets[0]];
    const uint32_t size = vkb_formats[source->format].channel_size;
    const int32_t ratio = ratio_of(&choice->plain, pass);
    memcpy(&row, pass, sizeof row);
    row.constants.exact = ratio == EXACT_DOUBLE ? 0 : ratio;
    row.constants.exact_rows = row.constants.exact;
    row.constants.enlarged = source->height < target->height;
    row.constants.window = vkb_find_window(set);
    if (!row.constants.exact && vkb_moves_texels(set))
        return false;
    if (choice->variants == VKB_VARIANTS_GPU)
        vkb_make_dispatch(&row, pass->shader->dispatch, PIXEL_INVOCATIONS, PIXEL_INVOCATIONS);
    else if (loads(choice, pass))
        make_linear(&row, taps_linear[source->format],
                    row.constants.exact ? TAP_COLUMNS(size) : 4 / size, TAP_ROWS);
    else
        return false;
    return vkb_add_variant_pass(choice, &row) && vkb_add_from_image_variant(choice, pass, &row);
}

// HDRP's blurs of images of the same size, and of twice the size along the line; Godot's horizontal
// one of an image of twice the size.
bool vkb_add_nine_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    const struct vkb_image_row *target = &choice->plain.images[pass->targets[0]];
    const bool rows = pass->constants.direction == DIRECTION_HORIZONTAL;
    const int32_t set = pass->constants.tap_set;
    const bool fits =
        set == TAPS_HDRP
            ? (pass->constants.first_level || pass->constants.sampling == SAMPLING_TEXEL)
                  && loads(choice, pass)
            : set == TAPS_GODOT && rows && ratio_of(&choice->plain, pass) == EXACT_HALF
                  && target->width % 2 == 0 && target->format == VKB_FORMAT_RGBA32_FLOAT
                  && vkb_fits_linear(choice, pass);
    struct vkb_pass_row row;

    if (!vkb_computes(pass, VKB_BLOCK_prefilter) || !fits)
        return false;
    const enum vkb_format format = choice->plain.images[pass->reads[SLOT_SOURCE]].format;
    memcpy(&row, pass, sizeof row);
    row.constants.exact = pass->constants.first_level && set == TAPS_HDRP ? EXACT_SAME : 0;
    if (rows)
        make_linear(&row, rows_linear[format], NINE_OUTPUTS, GATHER_ROWS);
    else
        make_linear(&row, columns_linear[format], 4 / vkb_formats[format].channel_size,
                    NINE_OUTPUTS);
    return vkb_add_variant_pass(choice, &row);
}
