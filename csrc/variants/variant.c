#include "variants/variant.h"

#include "passes/filter.h"

#include <math.h>
#include <string.h>

bool vkb_has_format_of(const struct vkb_graph *graph, uint32_t a, uint32_t b)
{
    return vkb_formats[graph->images[a].format].vk == vkb_formats[graph->images[b].format].vk;
}

bool vkb_add_variant_pass(struct vkb_variant_choice *choice, const struct vkb_pass_row *row)
{
    choice->failed = choice->failed || !vkb_graph_add_pass(choice->graph, row, choice->error);
    return true;
}

uint32_t vkb_add_float_image(struct vkb_variant_choice *choice, const char *name,
                             struct vkb_size size)
{
    uint32_t image = 0;

    choice->failed = choice->failed
                  || !vkb_add_target_image(choice->graph, name, VKB_FORMAT_RGBA32_FLOAT, size,
                                           false, &image, choice->error);
    return image;
}

bool vkb_is_written_once(const struct vkb_graph *graph, uint32_t image)
{
    uint32_t writers = 0;

    for (uint32_t i = 0; i < graph->pass_count; ++i)
        for (uint32_t target = 0; target < graph->passes[i].target_count; ++target)
            writers += graph->passes[i].targets[target] == image;
    return writers == 1;
}

void vkb_make_dispatch(struct vkb_pass_row *row, const struct vkb_shader *shader,
                       uint32_t block_width, uint32_t block_height)
{
    row->geometry = VKB_GEOMETRY_DISPATCH;
    row->vertex = NULL;
    row->shader = shader;
    row->block_width = block_width;
    row->block_height = block_height;
}

void vkb_make_linear(struct vkb_pass_row *row, const struct vkb_shader *shader, uint32_t columns,
                     uint32_t rows)
{
    vkb_make_dispatch(row, shader, ROW_INVOCATIONS * columns, rows);
    row->reading = VKB_READING_LINEAR_TEXELS;
}

void vkb_make_tiles(const struct vkb_variant_choice *choice, struct vkb_pass_row *row,
                    const struct vkb_shader *shader, int32_t width, int32_t height)
{
    struct vkb_constants *constants = &row->constants;

    // Tiles have one way for windows in a simple ratio along both axes, and one for all others
    // and for devices with little shared memory.
    if (!constants->exact || !constants->exact_rows
        || choice->device->limits.maxComputeSharedMemorySize < FILTER_TILE_SHARED)
        constants->exact = constants->exact_rows = 0;
    const bool keeps = FILTER_TILE_KEEPS(constants->exact, constants->kernels, width, height);
    constants->window_width = width;
    constants->window_height = height;
    constants->pictures = 1;
    vkb_make_dispatch(row, shader, FILTER_TILE_COLUMNS,
                      (uint32_t)FILTER_TILE_ROWS(keeps, constants->exact_rows, height));
}

bool vkb_fits_linear(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    bool fits = choice->device->linear_texels;

    for (uint32_t i = 0; i < pass->read_count; ++i) {
        if (pass->reads[i] == VKB_NO_IMAGE)
            continue;
        const struct vkb_image_row *row = &choice->graph->images[pass->reads[i]];
        fits = fits
            && vkb_image_fits_linear_texels(choice->device, row->format, row->width, row->height);
    }
    return fits;
}

const struct vkb_pass_row *vkb_bloom_of(const struct vkb_graph *graph,
                                        const struct vkb_pass_row *composite)
{
    const struct vkb_pass_row *pass =
        vkb_ends_bloom(composite) ? vkb_graph_writer(graph, composite->reads[SLOT_BLOOM]) : NULL;

    return pass && vkb_computes(pass, VKB_BLOCK_filter) ? pass : NULL;
}

const struct vkb_pass_row *vkb_threshold_of(const struct vkb_graph *graph, uint32_t image)
{
    const struct vkb_pass_row *pass = vkb_graph_writer(graph, image);

    return pass && vkb_is_threshold(pass)
                && graph->images[pass->reads[SLOT_SOURCE]].format == graph->images[image].format
             ? pass
             : NULL;
}

VKB_COPY_FUNCTION(copy_threshold, filter, threshold, THRESHOLD_ROWS(filter, VKB_COPY_READS))

bool vkb_add_from_image_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                                const struct vkb_pass_row *variant)
{
    const struct vkb_pass_row *threshold =
        vkb_threshold_of(&choice->plain, pass->reads[SLOT_SOURCE]);
    const bool is_filter = vkb_is_filter(pass);
    struct vkb_pass_row row;

    if (!threshold || (!is_filter && threshold->constants.threshold_mode != THRESHOLD_NONE))
        return true;
    memcpy(&row, variant, sizeof row);
    row.reads[SLOT_SOURCE] = threshold->reads[SLOT_SOURCE];
    row.fused = row.gains_if_finite = true;
    row.constants.from_image = true;
    if (is_filter) {
        row.constants.format =
            vkb_storage_mode(choice->plain.images[pass->reads[SLOT_SOURCE]].format);
        row.constants.threshold_mode = threshold->constants.threshold_mode;
        copy_threshold(&row.params.filter, &threshold->params.threshold);
    }
    return vkb_add_variant_pass(choice, &row);
}

bool vkb_is_factor(const struct vkb_pass_row *pass)
{
    return vkb_transposes(pass, VKB_BLOCK_composite) && pass->constants.by == BY_BLOOM
        && !pass->constants.adds_image && !pass->constants.of_source
        && pass->reads[SLOT_BLOOM] == VKB_NO_IMAGE
        && (pass->constants.composite == COMPOSITE_ADD
            || pass->constants.composite == COMPOSITE_ADD_TO_POSITIVE
            || pass->constants.composite == COMPOSITE_MIX);
}

float vkb_read_composite(const struct vkb_graph *graph, enum vkb_slot cotangents,
                         enum vkb_slot scene, struct vkb_pass_row *row)
{
    const struct vkb_pass_row *pass = vkb_graph_writer(graph, row->reads[cotangents]);

    if (!pass || !vkb_is_factor(pass))
        return 1.0f;
    const struct vkb_composite_params *params = &pass->params.composite;
    const float intensity = pass->constants.lit ? 1.0f : params->intensity;
    // Godot's exposure is of the scene alone.
    const float exposure = pass->constants.exposed_scene ? 0.0f : params->exposure;
    row->constants.through_composite = true;
    row->reads[cotangents] = pass->reads[SLOT_COTANGENTS];
    row->reads[scene] = pass->reads[SLOT_SCENE];
    return intensity * exp2f(exposure);
}
