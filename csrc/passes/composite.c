#include "passes/composite.h"

#include <string.h>

// The same as Godot blends, which no variant stands for.
static struct vkb_pass_row godots(const struct vkb_settings *settings,
                                  const struct vkb_pass_row *composite)
{
    struct vkb_pass_row row = *composite;

    memset(&row.params, 0, sizeof row.params);
    row.shader = VKB_SHADER_godot_final_frag;
    row.block = VKB_BLOCK_godot_final;
    VKB_TAKE_COMPOSITE(&row, godot_final, composite);
    row.params.godot_final.white = settings->values.white;
    return row;
}

bool vkb_add_composite(const struct vkb_settings *settings, uint32_t scene, uint32_t bloom,
                       enum vkb_format format, struct vkb_graph *graph, struct vkb_error *error)
{
    uint32_t final;
    struct vkb_image_row image = {
        .name = "final",
        .format = format,
        .width = graph->images[scene].width,
        .height = graph->images[scene].height,
        .channels = graph->images[scene].channels,
        .framebuffer = true,
    };

    if (!vkb_graph_add_image(graph, &image, &final, error))
        return false;
    struct vkb_pass_row row = vkb_fullscreen_row("final", VKB_SHADER_composite_frag, final);
    const bool off = bloom == VKB_NO_IMAGE;
    // Floats have no levels to round to.
    const bool dither = settings->values.dither && format == VKB_FORMAT_RGBA8_UNORM;
    row.constants.composite = off ? COMPOSITE_OFF : settings->choices[VKB_CHOICE_composite];
    row.constants.tonemap = settings->choices[VKB_CHOICE_tonemap];
    row.constants.encoding = settings->choices[VKB_CHOICE_encoding];
    row.constants.dither = dither;
    row.reads[0] = scene;
    // Every binding of the shader must be filled, also one that this variant does not read.
    row.reads[1] = off ? scene : bloom;
    row.read_count = 2;
    row.block = VKB_BLOCK_composite;
    vkb_params_read(row.block, &settings->values, &row.params);
    row.params.composite.limit = vkb_formats[image.format].limit;
    row.params.composite.noise_seed = dither ? settings->values.dither_seed : 0;
    if (settings->method == VKB_METHOD_GODOT && !off)
        row = godots(settings, &row);
    return vkb_graph_add_pass(graph, &row, error);
}

bool vkb_is_composite(const struct vkb_pass_row *pass)
{
    return pass->shader == VKB_SHADER_composite_frag && pass->constants.composite != COMPOSITE_OFF;
}
