#include "variants/variant.h"

enum vkb_mode vkb_stored_as(const struct vkb_device *device, enum vkb_format format)
{
    return format == VKB_FORMAT_RGBA8_UNORM
                && device->adapter.device_type == VK_PHYSICAL_DEVICE_TYPE_CPU
             ? STORED_UNORM8_SCALED
             : vkb_storage_mode(format);
}

bool vkb_has_format_of(const struct vkb_graph *graph, uint32_t a, uint32_t b)
{
    return vkb_formats[graph->images[a].format].vk == vkb_formats[graph->images[b].format].vk;
}

bool vkb_is_written_once(const struct vkb_graph *graph, uint32_t image)
{
    uint32_t writers = 0;

    for (uint32_t i = 0; i < graph->pass_count; ++i)
        for (uint32_t target = 0; target < graph->passes[i].target_count; ++target)
            writers += graph->passes[i].targets[target] == image;
    return writers == 1;
}

void vkb_drop_reads(struct vkb_pass_row *row, uint32_t read_count)
{
    while (row->read_count > read_count)
        row->reads[--row->read_count] = 0;
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

void vkb_make_words(struct vkb_pass_row *row, const struct vkb_shader *shader, uint32_t columns,
                    uint32_t rows)
{
    vkb_make_dispatch(row, shader, ROW_INVOCATIONS * columns, rows);
    row->reading = VKB_READING_WORDS;
}

bool vkb_fits_words(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    bool fits = choice->device->words;

    for (uint32_t i = 0; i < pass->read_count; ++i) {
        const struct vkb_image_row *row = &choice->graph->images[pass->reads[i]];
        fits = fits && vkb_image_fits_words(choice->device, row->format, row->width, row->height);
    }
    return fits;
}

const struct vkb_pass_row *vkb_writer_of(const struct vkb_graph *graph, uint32_t image)
{
    const struct vkb_pass_row *writer = NULL;

    for (uint32_t i = 0; i < graph->pass_count; ++i)
        if (graph->passes[i].target_count == 1 && graph->passes[i].targets[0] == image)
            writer = &graph->passes[i];
    return writer;
}

const struct vkb_pass_row *vkb_threshold_of(const struct vkb_graph *graph, uint32_t image)
{
    const struct vkb_pass_row *pass = vkb_writer_of(graph, image);

    return pass && vkb_is_threshold(pass)
                && graph->images[pass->reads[0]].format == graph->images[image].format
             ? pass
             : NULL;
}
