// Temporal anti-aliasing: a pass that mixes a frame with the history of the framebuffer that it
// writes, and one that makes light of this. What an engine does is its shader.
#include "methods/methods.h"

#include <stdio.h>
#include <string.h>

#define TAA_SHADER(constant, value, name, shader) [value] = &vkb_shader_##shader##_frag,
static const struct vkb_shader *const shaders[] = {TAAS(TAA_SHADER)};

static struct vkb_pass_row describe_pass(const struct vkb_levels *levels,
                                         const struct vkb_taa_inputs *inputs,
                                         const struct vkb_shader *shader, uint32_t from,
                                         uint32_t to)
{
    const struct vkb_settings *settings = levels->settings;
    struct vkb_pass_row row = vkb_fullscreen_row(levels->graph->images[to].name, shader, to);

    row.constants.engine = (int)settings->taa_engine;
    row.constants.moving = inputs->packed                   ? MOTION_PACKED
                         : inputs->motion_x != VKB_NO_IMAGE ? MOTION_PLANES
                                                            : 0;
    row.constants.deep = inputs->packed || inputs->depth != VKB_NO_IMAGE;
    row.block = VKB_BLOCK_taa;
    memcpy(&row.params.taa, settings->taa_numbers, sizeof settings->taa_numbers);
    memcpy(row.params.taa.weights, settings->taa_weights, sizeof settings->taa_weights);
    vkb_read_only(&row, from);
    return row;
}

// A framebuffer of the image's size; `channels` of it are read back, 0: all.
static uint32_t add_framebuffer(struct vkb_levels *levels, const char *name, const char *what,
                                uint32_t like, uint32_t channels)
{
    const struct vkb_image_row *of = &levels->graph->images[like];
    struct vkb_image_row row = {
        .format = VKB_FORMAT_RGBA32_FLOAT,
        .width = of->width,
        .height = of->height,
        .channels = channels,
        .framebuffer = true,
    };

    snprintf(row.name, sizeof row.name, "%s%s", name, what);
    return vkb_levels_add(levels, &row);
}

static void read_geometry(struct vkb_pass_row *row, const struct vkb_taa_inputs *inputs)
{
    vkb_read_at(row, SLOT_MOTION_X, inputs->motion_x);
    vkb_read_at(row, SLOT_MOTION_Y, inputs->motion_y);
    vkb_read_at(row, SLOT_DEPTH, inputs->depth);
}

// Adds the motion of this frame for the next one, and finds that of the frame before.
static void add_motion(struct vkb_levels *levels, struct vkb_taa_inputs *inputs, uint32_t image)
{
    const uint32_t motion = add_framebuffer(levels, "history_motion", "", image, 0);
    const uint32_t last = vkb_levels_history(levels, motion);
    if (levels->failed)
        return;
    struct vkb_pass_row row =
        describe_pass(levels, inputs, &vkb_shader_taa_motion_frag, image, motion);
    row.constants.deep = false;
    vkb_read_at(&row, SLOT_MOTION_X, inputs->motion_x);
    vkb_read_at(&row, SLOT_MOTION_Y, inputs->motion_y);
    vkb_levels_pass(levels, &row);
    inputs->last_motion = last;
}

// The light of what is kept, with the image's channels.
static uint32_t add_resolved(struct vkb_levels *levels, uint32_t image, uint32_t kept,
                             const char *what)
{
    const struct vkb_taa_inputs none = {VKB_NO_IMAGE, VKB_NO_IMAGE, VKB_NO_IMAGE, false,
                                        VKB_NO_IMAGE};
    const uint32_t channels = levels->graph->images[image].channels;
    const uint32_t resolved = add_framebuffer(levels, "resolved", what, image, channels);
    if (levels->failed)
        return 0;
    struct vkb_pass_row pass =
        describe_pass(levels, &none, &vkb_shader_taa_show_frag, image, resolved);
    vkb_read_at(&pass, SLOT_HISTORY, kept);
    vkb_levels_pass(levels, &pass);
    return resolved;
}

uint32_t vkb_add_taa(struct vkb_levels *levels, struct vkb_taa_inputs *inputs, uint32_t image,
                     const char *what)
{
    const uint32_t engine = levels->settings->taa_engine;

    if (levels->failed)
        return 0;
    const uint32_t kept = add_framebuffer(levels, "history", what, image, 0);
    const uint32_t before = vkb_levels_history(levels, kept);
    if (levels->failed)
        return 0;
    struct vkb_pass_row row = describe_pass(levels, inputs, shaders[engine], image, kept);
    if (engine == TAA_GODOT && inputs->last_motion == VKB_NO_IMAGE)
        add_motion(levels, inputs, image);
    vkb_read_at(&row, SLOT_HISTORY, before);
    vkb_read_at(&row, SLOT_LAST_MOTION, inputs->last_motion);
    read_geometry(&row, inputs);
    if (levels->failed)
        return 0;
    vkb_levels_pass(levels, &row);
    return add_resolved(levels, image, kept, what);
}
