// Variants of passes that read only the pixel at their own position, and the complete pass as a
// compute shader.
#include "variants/variant.h"

#include <string.h>

static const struct vkb_shader *const blend_shaders[VKB_FORMAT_COUNT] = VKB_LINEAR_BY_FORMAT(blend);
static const struct vkb_shader *const blender_end_shaders[VKB_FORMAT_COUNT] =
    VKB_LINEAR_BY_FORMAT(blender_end);
static const struct vkb_shader *const threshold_shaders[VKB_FORMAT_COUNT] =
    VKB_LINEAR_BY_FORMAT(threshold);

// Whether the pass is a composite whose images have the same size and format.
static bool blends(const struct vkb_graph *graph, const struct vkb_pass_row *pass)
{
    return vkb_is_composite(pass) && !pass->constants.masked
        && vkb_same_size(graph, pass->reads[SLOT_SCENE], pass->targets[0])
        && vkb_same_size(graph, pass->reads[SLOT_BLOOM], pass->targets[0])
        && vkb_has_format_of(graph, pass->reads[SLOT_SCENE], pass->reads[SLOT_BLOOM])
        && vkb_has_format_of(graph, pass->reads[SLOT_SCENE], pass->targets[0]);
}

// Whether the pass is the end of Blender's glare, which it need not enlarge.
static bool ends_glare(const struct vkb_graph *graph, const struct vkb_pass_row *pass)
{
    return vkb_computes(pass, VKB_BLOCK_blender_end) && !pass->params.blender_end.reads_next
        && vkb_same_size(graph, pass->reads[SLOT_SOURCE], pass->targets[0])
        && vkb_has_format_of(graph, pass->reads[SLOT_SOURCE], pass->targets[0]);
}

// Turns a pass that reads only the pixel at its own position into one that loads it.
static void load_pixels(const struct vkb_graph *graph, struct vkb_pass_row *row,
                        const struct vkb_shader *const *shaders)
{
    const enum vkb_format format = graph->images[row->reads[SLOT_SOURCE]].format;

    vkb_make_linear(row, shaders[format], TEXEL_COLUMNS(vkb_formats[format].channel_size),
                    TEXEL_ROWS);
}

// A workgroup for a pixel of the sums and one of the squares below, which fragments would compute
// one by one (lib/sums.glsl).
static void add_up(const struct vkb_graph *graph, struct vkb_pass_row *row)
{
    const struct vkb_image_row *target = &graph->images[row->targets[0]];

    vkb_make_dispatch(row, row->shader->dispatch, 1, 1);
    row->groups_width = target->width;
    row->groups_height = target->height / 2;
}

bool vkb_add_fullscreen_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    const struct vkb_graph *graph = choice->graph;
    struct vkb_pass_row row;

    memcpy(&row, pass, sizeof row);
    if (pass->constants.by == BY_VALUES)
        add_up(graph, &row);
    // An invocation computes sums and squares between nodes together, too.
    else if (choice->variants == VKB_VARIANTS_GPU || pass->block == VKB_BLOCK_node_sums)
        vkb_make_dispatch(&row, pass->shader->dispatch, PIXEL_INVOCATIONS, PIXEL_INVOCATIONS);
    else if (vkb_fits_linear(choice, pass) && blends(graph, pass))
        load_pixels(graph, &row, blend_shaders);
    else if (vkb_fits_linear(choice, pass) && ends_glare(graph, pass))
        load_pixels(graph, &row, blender_end_shaders);
    else if (vkb_fits_linear(choice, pass) && vkb_is_threshold(pass)
             && vkb_has_format_of(graph, pass->reads[SLOT_SOURCE], pass->targets[0]))
        load_pixels(graph, &row, threshold_shaders);
    return vkb_add_variant_pass(choice, &row);
}

bool vkb_add_pixels_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    return pass->geometry == VKB_GEOMETRY_FULLSCREEN && pass->shader->dispatch
        && vkb_is_written_once(&choice->plain, pass->targets[0])
        && vkb_add_fullscreen_variant(choice, pass);
}
