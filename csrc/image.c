// An image from the host: reduced to the bloom buffers, past the threshold, blurred, added to
// itself.
#include "methods.h"

static bool add_extract(const struct vkb_settings *settings, uint32_t image,
                        const struct vkb_bloom_source *source, struct vkb_graph *graph,
                        uint32_t *glow, struct vkb_error *error)
{
    struct vkb_image_row target = {
        .name = "glow",
        .format = source->format,
        .width = source->buffers.width,
        .height = source->buffers.height,
        .framebuffer = true,
    };

    if (!vkb_graph_add_image(graph, &target, glow, error))
        return false;
    struct vkb_pass_row row = vkb_fullscreen_row("glow", VKB_SHADER_extract_frag, *glow);
    const struct vkb_sampling sampling = vkb_sampling_into(graph, *glow);
    row.constants[0] = vkb_threshold_mode(settings);
    // Never the sampler's filter: it would spread NaN, and a threshold magnifies what it rounds.
    row.constants[1] = vkb_same_size(graph, image, *glow) ? SAMPLING_WHOLE : SAMPLING_FETCH;
    row.constant_count = 2;
    row.reads[0] = image;
    row.read_count = 1;
    row.block = VKB_BLOCK_extract;
    row.params.extract = (struct vkb_extract_params){
        .target_width = sampling.width,
        .target_height = sampling.height,
        .limit = sampling.limit,
    };
    if (row.constants[0] != THRESHOLD_NONE) {
        row.params.extract.threshold = settings->values.extract.threshold;
        row.params.extract.knee = settings->values.extract.knee;
    }
    return vkb_graph_add_pass(graph, &row, error);
}

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
        if (!add_extract(settings, input, &source, graph, &source.glow, error)
            || !vkb_add_bloom(settings, &source, graph, &bloom, error))
            return false;
    }
    return vkb_add_composite(settings, input, bloom, graph, error);
}
