// The methods that go down a chain of halved images and up again: the pyramid, which adds each
// level on the way up, and dual Kawase, which does not.
#include "methods.h"

#include <stdio.h>

enum { MAX_LEVELS = 16 };

struct chain {
    const struct vkb_settings *settings;
    const struct vkb_bloom_source *source;
    struct vkb_graph *graph;
    struct vkb_size sizes[MAX_LEVELS];
    uint32_t downs[MAX_LEVELS];
    uint32_t level_count;
};

static uint32_t half(uint32_t side)
{
    return side > 1 ? side / 2 : 1;
}

// down_0 is half of the bloom buffer; a level of 1 x 1 ends the chain, but the first one counts.
static void choose_sizes(struct chain *chain)
{
    struct vkb_size size = chain->source->buffers;

    for (int level = 0; level < chain->settings->values.levels; ++level) {
        size = (struct vkb_size){half(size.width), half(size.height)};
        if (level > 0 && size.width == 1 && size.height == 1)
            break;
        chain->sizes[chain->level_count++] = size;
    }
}

static bool add_image(const struct chain *chain, const char *name, struct vkb_size size,
                      uint32_t *image, struct vkb_error *error)
{
    struct vkb_image_row row = {
        .format = chain->source->format,
        .width = size.width,
        .height = size.height,
        .framebuffer = true,
    };

    snprintf(row.name, sizeof row.name, "%s", name);
    return vkb_graph_add_image(chain->graph, &row, image, error);
}

static struct vkb_pass_row chain_row(const struct chain *chain, uint32_t from, uint32_t to,
                                     enum vkb_shader pyramid, enum vkb_shader kawase)
{
    const struct vkb_settings *settings = chain->settings;
    const struct vkb_sampling sampling = vkb_sampling_into(chain->graph, to);
    const bool is_pyramid = settings->method == VKB_METHOD_PYRAMID;
    struct vkb_pass_row row =
        vkb_fullscreen_row(chain->graph->images[to].name, is_pyramid ? pyramid : kawase, to);

    row.reads[0] = from;
    row.read_count = 1;
    // Never the sampler's filter: lavapipe's is good to 8 bits, and the errors of a chain add up.
    row.constants[0] = SAMPLING_FETCH;
    row.constant_count = 1;
    if (is_pyramid) {
        row.block = VKB_BLOCK_pyramid;
        row.params.pyramid = (struct vkb_pyramid_params){
            .radius = settings->values.pyramid.radius,
            .target_width = sampling.width,
            .target_height = sampling.height,
            .limit = sampling.limit,
        };
    } else {
        row.block = VKB_BLOCK_kawase;
        row.params.kawase = (struct vkb_kawase_params){
            .offset = settings->values.kawase.offset,
            .target_width = sampling.width,
            .target_height = sampling.height,
            .limit = sampling.limit,
        };
    }
    return row;
}

static bool add_down(struct chain *chain, uint32_t level, struct vkb_error *error)
{
    const uint32_t from = level ? chain->downs[level - 1] : chain->source->glow;
    char name[VKB_NAME_SIZE];

    snprintf(name, sizeof name, "down_%u", level);
    if (!add_image(chain, name, chain->sizes[level], &chain->downs[level], error))
        return false;
    struct vkb_pass_row row = chain_row(chain, from, chain->downs[level],
                                        VKB_SHADER_pyramid_down_frag, VKB_SHADER_kawase_down_frag);
    if (chain->settings->method == VKB_METHOD_PYRAMID) {
        row.constants[1] = chain->settings->values.firefly_filter && level == 0;
        row.constant_count = 2;
    }
    return vkb_graph_add_pass(chain->graph, &row, error);
}

// From the smaller level `from` up to `to`; a pyramid adds the level `own`, if there is one.
static bool add_up(const struct chain *chain, uint32_t from, uint32_t to, uint32_t own,
                   float own_share, float coarse_share, struct vkb_error *error)
{
    struct vkb_pass_row row =
        chain_row(chain, from, to, VKB_SHADER_pyramid_up_frag, VKB_SHADER_kawase_up_frag);

    if (chain->settings->method == VKB_METHOD_PYRAMID) {
        row.constants[1] = own != VKB_NO_IMAGE;
        row.constant_count = 2;
        // Every binding of the shader must be filled, also one that this variant does not read.
        row.reads[1] = own != VKB_NO_IMAGE ? own : from;
        row.read_count = 2;
        row.params.pyramid.own = own_share;
        row.params.pyramid.coarse = coarse_share;
    }
    return vkb_graph_add_pass(chain->graph, &row, error);
}

// Sums of levels where the format holds them; in rgba8unorm, which ends at 1, their means. Either
// way the bloom is the sum of all levels divided by their number.
static bool add_ups(const struct chain *chain, uint32_t *top, struct vkb_error *error)
{
    const bool means = chain->source->format == VKB_FORMAT_RGBA8_UNORM;
    char name[VKB_NAME_SIZE];

    *top = chain->downs[chain->level_count - 1];
    for (uint32_t level = chain->level_count - 1; level-- > 0;) {
        const uint32_t below = chain->level_count - 1 - level, from = *top;
        const float whole = means ? (float)(below + 1) : 1.0f;
        snprintf(name, sizeof name, "up_%u", level);
        if (!add_image(chain, name, chain->sizes[level], top, error)
            || !add_up(chain, from, *top, chain->downs[level], 1.0f / whole,
                       (means ? (float)below : 1.0f) / whole, error))
            return false;
    }
    return true;
}

bool vkb_add_mip_chain(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                       struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    struct chain chain = {.settings = settings, .source = source, .graph = graph};
    const bool means = source->format == VKB_FORMAT_RGBA8_UNORM;
    uint32_t top;

    choose_sizes(&chain);
    for (uint32_t level = 0; level < chain.level_count; ++level)
        if (!add_down(&chain, level, error))
            return false;
    return add_ups(&chain, &top, error) && add_image(&chain, "bloom", source->final, bloom, error)
        && add_up(&chain, top, *bloom, VKB_NO_IMAGE, 0.0f,
                  means ? 1.0f : 1.0f / (float)chain.level_count, error);
}
