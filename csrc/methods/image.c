// An image from the host: reduced to the bloom buffers, past the threshold, blurred, added to
// itself.
#include "methods/methods.h"

bool vkb_build_image(const struct vkb_settings *settings, const struct vkb_image_source *image,
                     struct vkb_graph *graph, struct vkb_error *error)
{
    uint32_t input, bloom = VKB_NO_IMAGE;
    struct vkb_image_row row = {
        .name = "image",
        .format = image->format,
        .width = image->size.width,
        .height = image->size.height,
        .channels = image->channels,
        .input = true,
    };

    if (!vkb_graph_add_image(graph, &row, &input, error))
        return false;
    if (settings->values.bloom) {
        struct vkb_bloom_source source = {
            .buffers = vkb_bloom_size(settings, image->size),
            .final = image->size,
            .format = settings->format ? settings->format : image->format,
        };
        if (!vkb_add_target(graph, "glow", vkb_end_format(settings, source.format), source.buffers,
                            true, &source.glow, error)
            || !vkb_add_threshold(settings, input, source.glow, graph, error)
            || !vkb_add_bloom(settings, &source, graph, &bloom, error))
            return false;
    }
    return vkb_add_composite(settings, input, bloom, image->format, graph, error);
}
