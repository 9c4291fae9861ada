// A method whose passes were given at run time: each is a shader, the images that it reads by name,
// and the image that it writes.
#include "methods/methods.h"
#include "passes/levels.h"

#include <math.h>
#include <string.h>

static const char BLOOM[] = "bloom";

// Keeps the first failure.
#define FAIL(levels, ...) \
    ((levels)->failed = \
         (levels)->failed || !vkb_fail((levels)->error, VKB_ERROR_VALUE, __VA_ARGS__))

static uint32_t find_read(const struct vkb_bloom_source *source, const struct vkb_graph *graph,
                          const char *name)
{
    return strcmp(name, "MAIN") == 0 ? source->scene
         : strcmp(name, "GLOW") == 0 ? source->glow
                                     : vkb_graph_find(graph, name);
}

static uint32_t add_pass(struct vkb_levels *levels, const struct vkb_custom_pass *pass,
                         const char *name)
{
    const struct vkb_size size = {pass->width, pass->height};
    struct vkb_graph *graph = levels->graph;

    if (vkb_graph_find(graph, name) != VKB_NO_IMAGE)
        FAIL(levels, "passes: there are two images named %s", name);
    const uint32_t image = vkb_levels_target(levels, name, levels->source->format, size,
                                             pass->framebuffer && name == pass->name);
    struct vkb_pass_row row = vkb_fullscreen_row(pass->name, pass->shader, image);
    for (; row.read_count < pass->read_count; ++row.read_count) {
        const char *read = pass->reads[row.read_count];
        const uint32_t found = find_read(levels->source, graph, read);
        if (found == VKB_NO_IMAGE || found == image)
            FAIL(levels, "passes: %s reads %s, which no pass before it writes", pass->name, read);
        row.reads[row.read_count] = found;
    }
    if (pass->block_width) {
        row.geometry = VKB_GEOMETRY_DISPATCH;
        row.vertex = NULL;
        row.block_width = pass->block_width;
        row.block_height = pass->block_height;
    }
    row.block = VKB_BLOCK_custom;
    row.params.custom = pass->params;
    row.resources = pass->resources;
    row.resource_count = pass->resource_count;
    row.turn = pass->turn;
    vkb_levels_pass(levels, &row);
    return image;
}

static bool has_size(const struct vkb_custom_pass *pass, struct vkb_size size)
{
    return pass->width == size.width && pass->height == size.height;
}

uint32_t vkb_add_custom(struct vkb_levels *levels)
{
    const struct vkb_settings *settings = levels->settings;
    const struct vkb_size final = levels->source->final;
    uint32_t bloom = VKB_NO_IMAGE;

    for (uint32_t i = 0; i < settings->pass_count; ++i) {
        const struct vkb_custom_pass *pass = &settings->passes[i];
        const bool is_bloom = strcmp(pass->name, BLOOM) == 0, fits = has_size(pass, final);
        const uint32_t image = add_pass(levels, pass, is_bloom && !fits ? "bloom_own" : pass->name);
        if (is_bloom)
            bloom = fits ? image : vkb_levels_enlarge(levels, UPSAMPLE_LINEAR, image, 1.0);
        else if (strcmp(pass->name, VKB_CUSTOM_PICTURE) == 0 && !fits)
            FAIL(levels, "passes: %s is %u x %u, which is not the frame's size, %u x %u",
                 VKB_CUSTOM_PICTURE, pass->width, pass->height, final.width, final.height);
    }
    if (bloom == VKB_NO_IMAGE && vkb_graph_find(levels->graph, VKB_CUSTOM_PICTURE) == VKB_NO_IMAGE)
        FAIL(levels, "passes: none writes %s or %s", BLOOM, VKB_CUSTOM_PICTURE);
    return bloom;
}
