// A method whose passes were given at run time: each is a shader, the images that it reads by name,
// and the image that it writes.
#include "methods/methods.h"
#include "passes/levels.h"

#include <math.h>
#include <string.h>

static const char BLOOM[] = "bloom";

static uint32_t find_read(const struct vkb_bloom_source *source, const struct vkb_graph *graph,
                          const char *name)
{
    return strcmp(name, "MAIN") == 0 ? source->scene
         : strcmp(name, "GLOW") == 0 ? source->glow
                                     : vkb_graph_find(graph, name);
}

static bool add_pass(const struct vkb_custom_pass *pass, const char *name,
                     const struct vkb_bloom_source *source, struct vkb_graph *graph,
                     uint32_t *image, struct vkb_error *error)
{
    const struct vkb_size size = {pass->width, pass->height};

    if (vkb_graph_find(graph, name) != VKB_NO_IMAGE)
        return vkb_fail(error, VKB_ERROR_VALUE, "passes: there are two images named %s", name);
    if (!vkb_add_target(graph, name, source->format, size, pass->framebuffer && name == pass->name,
                        image, error))
        return false;
    struct vkb_pass_row row = vkb_fullscreen_row(pass->name, pass->shader, *image);
    for (; row.read_count < pass->read_count; ++row.read_count) {
        const char *read = pass->reads[row.read_count];
        const uint32_t found = find_read(source, graph, read);
        if (found == VKB_NO_IMAGE || found == *image)
            return vkb_fail(error, VKB_ERROR_VALUE,
                            "passes: %s reads %s, which no pass before it writes", pass->name,
                            read);
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
    return vkb_graph_add_pass(graph, &row, error);
}

static bool has_size(const struct vkb_custom_pass *pass, struct vkb_size size)
{
    return pass->width == size.width && pass->height == size.height;
}

bool vkb_add_custom(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                    struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    const struct vkb_levels levels = {.settings = settings, .source = source, .graph = graph};

    *bloom = VKB_NO_IMAGE;
    for (uint32_t i = 0; i < settings->pass_count; ++i) {
        const struct vkb_custom_pass *pass = &settings->passes[i];
        const bool enlarged = strcmp(pass->name, BLOOM) == 0 && !has_size(pass, source->final);
        uint32_t image;
        if (!add_pass(pass, enlarged ? "bloom_own" : pass->name, source, graph, &image, error)
            || (enlarged
                && !vkb_levels_enlarge(&levels, UPSAMPLE_LINEAR, image, 1.0, &image, error)))
            return false;
        if (strcmp(pass->name, BLOOM) == 0)
            *bloom = image;
        else if (strcmp(pass->name, VKB_CUSTOM_PICTURE) == 0 && !has_size(pass, source->final))
            return vkb_fail(error, VKB_ERROR_VALUE,
                            "passes: %s is %u x %u, which is not the frame's size, %u x %u",
                            VKB_CUSTOM_PICTURE, pass->width, pass->height, source->final.width,
                            source->final.height);
    }
    if (*bloom == VKB_NO_IMAGE && vkb_graph_find(graph, VKB_CUSTOM_PICTURE) == VKB_NO_IMAGE)
        return vkb_fail(error, VKB_ERROR_VALUE, "passes: none writes %s or %s", BLOOM,
                        VKB_CUSTOM_PICTURE);
    return true;
}
