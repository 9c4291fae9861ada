// Variants of downsampling, and of the first passes of published methods.
#include "variants/variant.h"

#include "passes/filter.h"

#include <string.h>

static const struct vkb_shader *const halve_taps_linear[VKB_FORMAT_COUNT] =
    VKB_LINEAR_BY_FORMAT(halve_taps);
static const struct vkb_shader *const prefilter_linear[VKB_FORMAT_COUNT] =
    VKB_LINEAR_BY_FORMAT(prefilter);
static const struct vkb_shader *const shrink_linear[VKB_FORMAT_COUNT] =
    VKB_LINEAR_BY_FORMAT(shrink);
static const struct vkb_shader *const rows_linear[VKB_FORMAT_COUNT] =
    VKB_LINEAR_BY_FORMAT(nine_rows);
static const struct vkb_shader *const columns_linear[VKB_FORMAT_COUNT] =
    VKB_LINEAR_BY_FORMAT(nine_columns);
// Whether the pass can be one of linear texels, whose shaders are compiled for one format of all
// images.
static bool loads(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    return vkb_fits_linear(choice, pass)
        && vkb_has_format_of(&choice->plain, pass->reads[0], pass->targets[0]);
}

// What a pass makes of its taps, of GROUPS_*; 0: it has no groups of taps.
static enum vkb_mode groups_of(const struct vkb_pass_row *pass)
{
    return vkb_computes(pass, VKB_BLOCK_prefilter) ? (enum vkb_mode)pass->constants.groups : 0;
}

static bool has_unit_steps(const struct vkb_pass_row *pass)
{
    return pass->params.prefilter.step_x == 1.0f && pass->params.prefilter.step_y == 1.0f;
}

// Whether the pass weights the taps of a downsampling, which are one and two texels apart.
static bool weights_taps(const struct vkb_pass_row *pass)
{
    const enum vkb_mode groups = groups_of(pass);

    return (groups == GROUPS_PYRAMID || groups == GROUPS_PYGFX || groups == GROUPS_PYGFX_KARIS
            || groups == GROUPS_BLENDER || groups == GROUPS_BOX)
        && has_unit_steps(pass) && !pass->constants.masked;
}

// Whether the target has exactly half of the size of the image that the pass reads.
static bool is_half(const struct vkb_graph *graph, const struct vkb_pass_row *pass)
{
    const struct vkb_image_row *source = &graph->images[pass->reads[0]];
    const struct vkb_image_row *target = &graph->images[pass->targets[0]];

    return source->width == 2 * target->width && source->height == 2 * target->height;
}

// Adds the pass as one of linear texels, which loads the texels of its first image. With `fuses`,
// its shader has FROM_IMAGE: adds a fused pass that reads the image itself.
static bool add_linear(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                       const struct vkb_shader *shader, uint32_t columns, uint32_t rows, bool fuses,
                       struct vkb_error *error)
{
    struct vkb_pass_row row;

    memcpy(&row, pass, sizeof row);
    row.constants.sampling = 0;
    vkb_drop_reads(&row, 1);
    vkb_make_linear(&row, shader, columns, rows);
    return vkb_graph_add_pass(choice->graph, &row, error)
        && (!fuses || vkb_add_from_image(choice, pass, &row, error));
}

bool vkb_add_halved_taps(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                         bool *fits, struct vkb_error *error)
{
    const struct vkb_image_row *source = &choice->plain.images[pass->reads[0]];

    *fits = weights_taps(pass) && is_half(&choice->plain, pass) && loads(choice, pass);
    return !*fits
        || add_linear(choice, pass, halve_taps_linear[source->format], HALVE_LINEAR_COLUMNS,
                      HALVE_LINEAR_ROWS, false, error);
}

bool vkb_add_prefiltered(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                         bool *fits, struct vkb_error *error)
{
    const enum vkb_format format = choice->plain.images[pass->reads[0]].format;
    const enum vkb_mode groups = groups_of(pass);
    const bool same = vkb_same_size(&choice->plain, pass->reads[0], pass->targets[0]);
    struct vkb_pass_row row;

    *fits = (groups == GROUPS_FILAMENT || groups == GROUPS_HDRP || groups == GROUPS_URP
             || groups == GROUPS_POST_PROCESSING || groups == GROUPS_THREE
             || groups == GROUPS_BABYLON || (same && groups == GROUPS_KINO)
             || (same && groups == GROUPS_HIGHLIGHTS && pass->constants.radius <= 1))
         && !pass->constants.masked && (same || is_half(&choice->plain, pass))
         && loads(choice, pass);
    if (!*fits)
        return true;
    memcpy(&row, pass, sizeof row);
    row.constants.exact = same ? EXACT_SAME : EXACT_HALF;
    return add_linear(choice, &row, prefilter_linear[format],
                      PREFILTER_COLUMNS(vkb_formats[format].channel_size), TEXEL_ROWS, true, error);
}

bool vkb_add_shrunk(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                    bool *fits, struct vkb_error *error)
{
    const struct vkb_image_row *source = &choice->plain.images[pass->reads[0]];
    const struct vkb_image_row *target = &choice->plain.images[pass->targets[0]];
    const enum vkb_mode groups = groups_of(pass);
    const bool taps = groups == GROUPS_FILAMENT || (groups == GROUPS_BEVY && has_unit_steps(pass));

    *fits = taps && !pass->constants.masked && loads(choice, pass);
    if (!*fits)
        return true;
    struct vkb_pass_row row;
    memcpy(&row, pass, sizeof row);
    row.constants.enlarged = source->height < target->height;
    return add_linear(choice, &row, shrink_linear[source->format],
                      4 / vkb_formats[source->format].channel_size, SHRINK_ROWS, true, error);
}

// HDRP's blurs of images of the same size, and of twice the size along the line; Godot's horizontal
// one of an image of twice the size.
bool vkb_add_nine(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                  bool *fits, struct vkb_error *error)
{
    const struct vkb_image_row *target = &choice->plain.images[pass->targets[0]];
    const enum vkb_format format = choice->plain.images[pass->reads[0]].format;
    const bool rows = pass->constants.direction == DIRECTION_HORIZONTAL;
    struct vkb_pass_row row;

    *fits = groups_of(pass) == GROUPS_HDRP_BLUR
              ? (pass->constants.first || pass->constants.sampling == SAMPLING_TEXEL)
                    && loads(choice, pass)
              : groups_of(pass) == GROUPS_GODOT_BLUR && rows && is_half(&choice->plain, pass)
                    && target->width % 2 == 0 && target->format == VKB_FORMAT_RGBA32_FLOAT
                    && vkb_fits_linear(choice, pass);
    if (!*fits)
        return true;
    memcpy(&row, pass, sizeof row);
    row.constants.exact =
        pass->constants.first && pass->constants.groups == GROUPS_HDRP_BLUR ? EXACT_SAME : 0;
    return rows ? add_linear(choice, &row, rows_linear[format], NINE_OUTPUTS, GATHER_ROWS, false,
                             error)
                : add_linear(choice, &row, columns_linear[format],
                             4 / vkb_formats[format].channel_size, NINE_OUTPUTS, false, error);
}
