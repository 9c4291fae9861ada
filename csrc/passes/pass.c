#include "passes/pass.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

struct vkb_pass_row vkb_fullscreen_row(const char *name, const struct vkb_shader *fragment,
                                       uint32_t target)
{
    struct vkb_pass_row row;

    // memset, since an initializer sets only the first member of the union of parameters.
    memset(&row, 0, sizeof row);
    vkb_set_name(row.name, sizeof row.name, name);
    row.geometry = VKB_GEOMETRY_FULLSCREEN;
    row.vertex = &vkb_shader_fullscreen_vert;
    row.shader = fragment;
    row.targets[0] = target;
    row.target_count = 1;
    row.depth = VKB_NO_IMAGE;
    return row;
}

void vkb_apply_mask(struct vkb_pass_row *row, uint32_t mask)
{
    row->constants.masked = mask != VKB_NO_IMAGE;
    vkb_read_at(row, SLOT_MASK, mask);
}

void vkb_read_at(struct vkb_pass_row *row, enum vkb_slot slot, uint32_t image)
{
    while (row->read_count <= (uint32_t)slot)
        row->reads[row->read_count++] = VKB_NO_IMAGE;
    row->reads[slot] = image;
}

void vkb_read_only(struct vkb_pass_row *row, uint32_t source)
{
    memset(row->reads, 0, sizeof row->reads);
    row->read_count = 0;
    vkb_read_at(row, SLOT_SOURCE, source);
}

struct vkb_size vkb_size_of(const struct vkb_graph *graph, uint32_t image)
{
    return (struct vkb_size){graph->images[image].width, graph->images[image].height};
}

bool vkb_same_size(const struct vkb_graph *graph, uint32_t a, uint32_t b)
{
    const struct vkb_image_row *first = &graph->images[a], *second = &graph->images[b];
    return first->width == second->width && first->height == second->height;
}

bool vkb_add_target_image(struct vkb_graph *graph, const char *name, enum vkb_format format,
                          struct vkb_size size, bool framebuffer, uint32_t *index,
                          struct vkb_error *error)
{
    struct vkb_image_row row = {
        .format = format,
        .width = size.width,
        .height = size.height,
        .framebuffer = framebuffer,
    };

    vkb_set_name(row.name, sizeof row.name, name);
    return vkb_graph_add_image(graph, &row, index, error);
}

uint32_t vkb_add_first_image(struct vkb_levels *levels, enum vkb_format format,
                             struct vkb_size size, bool framebuffer)
{
    const char *name = vkb_method_of(levels->settings)->first;

    return vkb_levels_target(levels, name ? name : "glow", format, size, framebuffer && !name);
}

enum vkb_format vkb_first_format(const struct vkb_settings *settings, enum vkb_format buffers)
{
    return vkb_formats[buffers].of_frames ? buffers : vkb_end_format(settings, buffers);
}

enum vkb_format vkb_end_format(const struct vkb_settings *settings, enum vkb_format buffers)
{
    return vkb_formats[buffers].rounded && vkb_method_of(settings)->published
             ? VKB_FORMAT_RGBA32_FLOAT
             : buffers;
}

struct vkb_image_row vkb_given_image(const char *name, const struct vkb_kernel_data *data)
{
    struct vkb_image_row row = {
        .format = VKB_FORMAT_RGBA32_FLOAT,
        .width = data->width,
        .height = data->height,
        .pixels = data->pixels,
        .grey = data->grey,
        .serial = data->serial,
    };

    vkb_set_name(row.name, sizeof row.name, name);
    return row;
}

uint32_t vkb_levels_add(struct vkb_levels *levels, const struct vkb_image_row *row)
{
    uint32_t image = 0;

    levels->failed =
        levels->failed || !vkb_graph_add_image(levels->graph, row, &image, levels->error);
    return image;
}

uint32_t vkb_levels_target(struct vkb_levels *levels, const char *name, enum vkb_format format,
                           struct vkb_size size, bool framebuffer)
{
    uint32_t image = 0;

    levels->failed = levels->failed
                  || !vkb_add_target_image(levels->graph, name, format, size, framebuffer, &image,
                                           levels->error);
    return image;
}

// Adds an image of the bloom's format whose name is made by a format of printf.
static uint32_t add_named(struct vkb_levels *levels, struct vkb_size size, bool framebuffer,
                          const char *format, va_list arguments)
{
    char name[VKB_NAME_SIZE];

    vsnprintf(name, sizeof name, format, arguments);
    return vkb_levels_target(levels, name, levels->source->format, size, framebuffer);
}

uint32_t vkb_levels_image(struct vkb_levels *levels, struct vkb_size size, const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    const uint32_t image = add_named(levels, size, true, format, arguments);
    va_end(arguments);
    return image;
}

uint32_t vkb_levels_history(struct vkb_levels *levels, uint32_t image)
{
    uint32_t history = 0;

    levels->failed =
        levels->failed || !vkb_graph_add_history(levels->graph, image, &history, levels->error);
    return history;
}

uint32_t vkb_levels_down(struct vkb_levels *levels, uint32_t level)
{
    levels->downs[level] = vkb_levels_image(levels, levels->sizes[level], "down_%u", level);
    return levels->downs[level];
}

uint32_t vkb_levels_step(struct vkb_levels *levels, struct vkb_size size, const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    const uint32_t image = add_named(levels, size, false, format, arguments);
    va_end(arguments);
    return image;
}

uint32_t vkb_levels_bloom(struct vkb_levels *levels)
{
    return vkb_levels_target(levels, "bloom",
                             vkb_end_format(levels->settings, levels->source->format),
                             levels->source->final, true);
}

void vkb_set_filters(struct vkb_levels *levels, struct vkb_pass_row *row,
                     const struct vkb_filter *filters, uint32_t count)
{
    if (levels->failed)
        return;
    row->filters = vkb_graph_keep_filters(levels->graph, filters, count, levels->error);
    row->filter_count = count;
    levels->failed = !row->filters;
}

void vkb_join(struct vkb_levels *levels, const struct vkb_pass_row *first,
              struct vkb_pass_row *second)
{
    if (levels->failed)
        return;
    const struct vkb_filter *one = first->filters, *other = second->filters;
    const struct vkb_filter *rows = vkb_axis_is_identity(&one->y) ? one : other;
    const struct vkb_filter *columns = rows == one ? other : one;
    const struct vkb_filter joined = {
        .x = rows->x,
        .y = columns->y,
        .kernels = 1,
        .gain = one->gain * other->gain,
        .divisor = 1.0,
    };

    if (!vkb_axis_is_identity(&rows->y) || !vkb_axis_is_identity(&columns->x))
        return;
    second->joined = vkb_graph_keep_filters(levels->graph, &joined, 1, levels->error);
    second->joined_from = first->reads[SLOT_SOURCE];
    second->joined_count = 1;
    levels->failed = !second->joined;
}

void vkb_levels_pass(struct vkb_levels *levels, const struct vkb_pass_row *row)
{
    levels->failed = levels->failed || !vkb_graph_add_pass(levels->graph, row, levels->error);
}

void vkb_levels_masked(struct vkb_levels *levels, struct vkb_pass_row *row)
{
    vkb_apply_mask(row, levels->source->mask);
    vkb_levels_pass(levels, row);
}
