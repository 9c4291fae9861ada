// Variants of upsampling by any factor: in strips, or as two passes, along rows and along columns.
#include "variants/variant.h"

#include "passes/levels.h"

#include <stdio.h>
#include <string.h>

static const struct vkb_shader *const strip_shaders[VKB_FORMAT_COUNT] =
    VKB_WORDS_BY_FORMAT(upsample);
static const struct vkb_shader *const final_shaders[VKB_FORMAT_COUNT] =
    VKB_WORDS_BY_FORMAT(upsample_final);
static const struct vkb_shader *const rows_shaders[VKB_FORMAT_COUNT] =
    VKB_WORDS_BY_FORMAT(filter_rows);
static const struct vkb_shader *const columns_shaders[VKB_FORMAT_COUNT] =
    VKB_WORDS_BY_FORMAT(filter_columns);
static const struct vkb_shader *const gather_shaders[VKB_FORMAT_COUNT] =
    VKB_WORDS_BY_FORMAT(gather_columns);
static const struct vkb_shader *const kawase_shaders[VKB_FORMAT_COUNT] =
    VKB_WORDS_BY_FORMAT(kawase_up);

// The size of an image that is filtered along rows.
static struct vkb_size rows_size(const struct vkb_variant_choice *choice,
                                 const struct vkb_pass_row *pass, uint32_t from)
{
    return (struct vkb_size){choice->graph->images[pass->targets[0]].width,
                             choice->graph->images[from].height};
}

// Whether words reach all pixels of the first `count` images that the pass reads, also filtered.
static bool fits_rows(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                      uint32_t count)
{
    bool fits = vkb_fits_words(choice, pass);

    for (uint32_t i = 0; i < count; ++i) {
        const struct vkb_size size = rows_size(choice, pass, pass->reads[i]);
        fits = fits
            && vkb_image_fits_words(choice->device, VKB_FORMAT_RGBA32_FLOAT, size.width,
                                    size.height);
    }
    return fits;
}

// A filter along rows: the image that it reads, its kind of UPSAMPLE_*, and the distance of its
// taps in texels.
struct row_filter {
    uint32_t from;
    enum vkb_mode kind;
    float step;
};

// Adds an image and the pass that filters along rows into it, at the positions of the pixels of the
// target of `pass`.
static bool add_rows(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                     const struct row_filter *filter, uint32_t number, uint32_t *rows,
                     struct vkb_error *error)
{
    const uint32_t from = filter->from;
    const struct vkb_size size = rows_size(choice, pass, from);
    const enum vkb_format format = choice->graph->images[from].format;
    char name[VKB_NAME_SIZE];
    struct vkb_pass_row row;

    snprintf(name, sizeof name, "%.20s_rows_%u", pass->name, number);
    if (!vkb_add_target(choice->graph, name, VKB_FORMAT_RGBA32_FLOAT, size, false, rows, error))
        return false;
    memcpy(&row, pass, sizeof row);
    row.constants = (struct vkb_constants){.upsample = (int32_t)filter->kind};
    memset(&row.params, 0, sizeof row.params);
    row.block = VKB_BLOCK_pyramid;
    row.params.pyramid.step_x = filter->step;
    row.reads[0] = from;
    vkb_drop_reads(&row, 1);
    row.targets[0] = *rows;
    vkb_make_words(&row, rows_shaders[format], FILTER_COLUMNS, FILTER_ROWS);
    return vkb_graph_add_pass(choice->graph, &row, error);
}

static void make_columns(const struct vkb_variant_choice *choice, struct vkb_pass_row *row,
                         const struct vkb_shader *const *shaders)
{
    const enum vkb_format format = choice->graph->images[row->targets[0]].format;

    row->constants.sampling = 0;
    vkb_make_words(row, shaders[format], TEXEL_COLUMNS(vkb_formats[format].channel_size),
                   FILTER_ROWS);
}

bool vkb_only_scales(const struct vkb_graph *graph, const struct vkb_pass_row *pass)
{
    return pass->constants.upsample == UPSAMPLE_LINEAR && !pass->constants.add_own
        && vkb_same_size(graph, pass->reads[0], pass->targets[0]);
}

// Whether the image that the pass reads is not higher than its target, both complete if they are
// bands (see SAMPLING_ROWS).
static bool is_enlarged(const struct vkb_graph *graph, const struct vkb_pass_row *pass,
                        int source_height, int target_height)
{
    const uint32_t own = graph->images[pass->reads[0]].height;

    return (source_height ? (uint32_t)source_height : own) <= (uint32_t)target_height;
}

// Whether the pass upsamples a level, not larger than its target and of the same format, with a
// filter of adjacent texels.
static bool fits_strips(const struct vkb_graph *graph, const struct vkb_pass_row *pass)
{
    const struct vkb_pyramid_params *params = &pass->params.pyramid;
    const int32_t kind = pass->constants.upsample;

    if (pass->shader != &vkb_shader_pyramid_up_frag || vkb_doubles(pass)
        || vkb_only_scales(graph, pass))
        return false;
    return (kind == UPSAMPLE_LINEAR || kind == UPSAMPLE_CUBIC || kind == UPSAMPLE_UNIT_TENT)
        && is_enlarged(graph, pass, params->source_height, params->target_height)
        && vkb_has_format_of(graph, pass->reads[0], pass->targets[0]);
}

static void make_strips(const struct vkb_variant_choice *choice, struct vkb_pass_row *row,
                        const struct vkb_shader *const *shaders)
{
    const enum vkb_format format = choice->graph->images[row->targets[0]].format;

    row->constants.sampling = 0;
    vkb_make_words(row, shaders[format], UPSAMPLE_COLUMNS(vkb_formats[format].channel_size),
                   UPSAMPLE_ROWS);
}

bool vkb_add_upsampled_strips(const struct vkb_variant_choice *choice,
                              const struct vkb_pass_row *pass, bool *fits, struct vkb_error *error)
{
    struct vkb_pass_row row;

    *fits = fits_strips(&choice->plain, pass) && vkb_fits_words(choice, pass)
         && (!pass->constants.add_own
             || vkb_has_format_of(&choice->plain, pass->reads[1], pass->targets[0]));
    if (!*fits)
        return true;
    memcpy(&row, pass, sizeof row);
    make_strips(choice, &row, strip_shaders);
    return vkb_graph_add_pass(choice->graph, &row, error);
}

// Adds the composite, and after it a fused pass that also upsamples the last level.
bool vkb_add_upsampled_final(const struct vkb_variant_choice *choice,
                             const struct vkb_pass_row *pass, bool *fits, struct vkb_error *error)
{
    const struct vkb_graph *plain = &choice->plain;
    const struct vkb_pass_row *up = NULL;
    struct vkb_pass_row row;
    struct vkb_upsample_final_params *params = &row.params.upsample_final;

    if (vkb_is_composite(pass))
        up = vkb_writer_of(plain, pass->reads[1]);
    *fits = up && fits_strips(plain, up) && !up->constants.add_own && !pass->constants.masked
         && vkb_has_format_of(plain, up->reads[0], pass->targets[0])
         && vkb_has_format_of(plain, pass->reads[0], pass->targets[0])
         && plain->images[pass->reads[1]].format == plain->images[pass->targets[0]].format
         && vkb_same_size(plain, pass->reads[1], pass->targets[0]) && vkb_fits_words(choice, pass);
    if (!*fits)
        return true;
    memcpy(&row, pass, sizeof row);
    memset(&row.params, 0, sizeof row.params);
    row.fused = true;
    row.reads[0] = up->reads[0];
    row.reads[1] = pass->reads[0];
    vkb_drop_reads(&row, 2);
    row.block = VKB_BLOCK_upsample_final;
    params->target_width = up->params.pyramid.target_width;
    params->target_height = up->params.pyramid.target_height;
    params->source_height = up->params.pyramid.source_height;
    params->row_offset = up->params.pyramid.row_offset;
    params->coarse = up->params.pyramid.coarse;
    VKB_TAKE_COMPOSITE(&row, upsample_final, pass);
    make_strips(choice, &row, final_shaders);
    row.constants.upsample = up->constants.upsample;
    row.constants.format = vkb_stored_as(choice->device, plain->images[pass->reads[1]].format);
    return vkb_add_fullscreen(choice, pass, error)
        && vkb_graph_add_pass(choice->graph, &row, error);
}

bool vkb_add_upsampled(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                       bool *fits, struct vkb_error *error)
{
    struct vkb_pass_row row;

    *fits = pass->shader == &vkb_shader_pyramid_up_frag && !vkb_doubles(pass)
         && !vkb_only_scales(&choice->plain, pass) && fits_rows(choice, pass, 1)
         && (!pass->constants.add_own
             || vkb_has_format_of(&choice->plain, pass->reads[1], pass->targets[0]));
    if (!*fits)
        return true;
    memcpy(&row, pass, sizeof row);
    const struct row_filter filter = {
        .from = pass->reads[0],
        .kind = (enum vkb_mode)pass->constants.upsample,
        .step = pass->params.pyramid.step_x,
    };
    if (!add_rows(choice, pass, &filter, 0, &row.reads[0], error))
        return false;
    if (!pass->constants.add_own)
        row.reads[1] = row.reads[0];
    make_columns(choice, &row, columns_shaders);
    return vkb_graph_add_pass(choice->graph, &row, error);
}

bool vkb_add_gathered(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                      bool *fits, struct vkb_error *error)
{
    struct vkb_pass_row row;
    const uint32_t levels = (uint32_t)pass->constants.levels;
    const bool own = pass->constants.upsample == UPSAMPLE_LINEAR
                  && vkb_same_size(&choice->plain, pass->reads[0], pass->targets[0])
                  && vkb_has_format_of(&choice->plain, pass->reads[0], pass->targets[0]);

    *fits = pass->shader == &vkb_shader_gather_frag && fits_rows(choice, pass, levels);
    if (!*fits)
        return true;
    memcpy(&row, pass, sizeof row);
    row.constants.add_own = own;
    for (uint32_t level = own; level < levels; ++level) {
        const struct row_filter filter = {
            .from = pass->reads[level],
            .kind = (enum vkb_mode)pass->constants.upsample,
        };
        if (!add_rows(choice, pass, &filter, level, &row.reads[level], error))
            return false;
    }
    for (uint32_t level = levels; level < row.read_count; ++level)
        row.reads[level] = row.reads[0];
    make_columns(choice, &row, gather_shaders);
    return vkb_graph_add_pass(choice->graph, &row, error);
}

bool vkb_add_kawase_up(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                       bool *fits, struct vkb_error *error)
{
    const struct vkb_graph *plain = &choice->plain;
    const struct vkb_kawase_params *params = &pass->params.kawase;
    const enum vkb_format format = plain->images[pass->targets[0]].format;
    struct vkb_pass_row row;

    *fits = pass->shader == &vkb_shader_kawase_up_frag
         && is_enlarged(plain, pass, params->source_height, params->target_height)
         && plain->images[pass->reads[0]].width <= plain->images[pass->targets[0]].width
         && vkb_has_format_of(plain, pass->reads[0], pass->targets[0])
         && vkb_fits_words(choice, pass);
    if (!*fits)
        return true;
    memcpy(&row, pass, sizeof row);
    vkb_make_words(&row, kawase_shaders[format], 4 / vkb_formats[format].channel_size,
                   UPSAMPLE_ROWS);
    return vkb_graph_add_pass(choice->graph, &row, error);
}
