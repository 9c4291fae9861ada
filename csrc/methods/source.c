#include "methods/source.h"

#include <string.h>

static const struct shading {
    const char *name;
    void (*build)(struct vkb_levels *, const struct vkb_scene_source *);
} shadings[] = {
    {"forward", vkb_build_forward},
    {"deferred", vkb_build_deferred},
};

static bool build_scene(struct vkb_levels *levels, const char *shading,
                        const struct vkb_scene_source *source)
{
    for (size_t i = 0; i < sizeof shadings / sizeof shadings[0]; ++i)
        if (strcmp(shadings[i].name, shading) == 0) {
            shadings[i].build(levels, source);
            return !levels->failed;
        }
    return vkb_fail(levels->error, VKB_ERROR_VALUE, "shading: there is no %s", shading);
}

bool vkb_source_build(const struct vkb_source *source, const struct vkb_settings *settings,
                      uint32_t max_side, struct vkb_graph *graph, struct vkb_error *error)
{
    struct vkb_levels levels = {.settings = settings, .graph = graph, .error = error};

    switch (source->kind) {
    case VKB_SOURCE_NONE:
        break;
    case VKB_SOURCE_SCENE:
        return vkb_check_sizes(settings, "size", source->scene.size, max_side, error)
            && build_scene(&levels, source->shading, &source->scene);
    case VKB_SOURCE_IMAGE:
        graph->layers = source->image.layers;
        if (!vkb_check_sizes(settings, "image", source->image.size, max_side, error))
            return false;
        vkb_build_image(&levels, &source->image);
        return !levels.failed;
    }
    return vkb_fail(error, VKB_ERROR_GENERAL, "source: there is nothing in it");
}

bool vkb_source_sizes(const struct vkb_source *source, const struct vkb_settings *settings,
                      uint32_t max_side, struct vkb_size *frame, struct vkb_size *buffers,
                      struct vkb_error *error)
{
    const bool scene = source->kind == VKB_SOURCE_SCENE;

    *frame = scene ? source->scene.size : source->image.size;
    if (!vkb_check_sizes(settings, scene ? "size" : "image", *frame, max_side, error))
        return false;
    *buffers = scene && strcmp(source->shading, "forward") == 0
                 ? vkb_forward_buffers(settings, *frame)
                 : vkb_bloom_size(settings, *frame);
    return true;
}

static bool same_size(struct vkb_size one, struct vkb_size other)
{
    return one.width == other.width && one.height == other.height;
}

static bool same_image(const struct vkb_image_source *one, const struct vkb_image_source *other)
{
    bool same = one->format == other->format && one->channels == other->channels
             && one->layers == other->layers && same_size(one->size, other->size)
             && one->has_emission == other->has_emission && one->has_mask == other->has_mask
             && one->has_motion == other->has_motion && one->has_depth == other->has_depth
             && one->level_count == other->level_count;

    for (uint32_t i = 0; same && i < one->level_count; ++i)
        same = one->levels[i].format == other->levels[i].format
            && same_size(one->levels[i].size, other->levels[i].size);
    return same;
}

static bool same_scene(const struct vkb_scene_source *one, const struct vkb_scene_source *other)
{
    return same_size(one->size, other->size) && one->has_sky == other->has_sky
        && one->has_glow == other->has_glow && one->has_emission == other->has_emission
        && one->body_textured == other->body_textured && one->glow_textured == other->glow_textured;
}

bool vkb_source_matches(const struct vkb_source *planned, const struct vkb_source *given)
{
    if (planned->kind != given->kind)
        return false;
    if (given->kind == VKB_SOURCE_IMAGE)
        return same_image(&planned->image, &given->image);
    return given->kind == VKB_SOURCE_SCENE && same_scene(&planned->scene, &given->scene)
        && strcmp(planned->shading, given->shading) == 0;
}

// Whether a frame has the same camera, place of the body and intensity, to the bit.
static bool same_frame(const struct vkb_scene_source *one, const struct vkb_scene_source *other)
{
    return memcmp(one->projection, other->projection, sizeof one->projection) == 0
        && memcmp(one->model_view, other->model_view, sizeof one->model_view) == 0
        && memcmp(one->sky, other->sky, sizeof one->sky) == 0
        && memcmp(one->before, other->before, sizeof one->before) == 0
        && memcmp(one->jitter, other->jitter, sizeof one->jitter) == 0
        && one->glow_intensity == other->glow_intensity;
}

bool vkb_source_fits(const struct vkb_source *planned, const struct vkb_source *given)
{
    return vkb_source_matches(planned, given)
        && (given->kind == VKB_SOURCE_IMAGE || same_frame(&planned->scene, &given->scene));
}
