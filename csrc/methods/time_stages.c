// The stages in time around a bloom, and their order: that of the engine whose exposure it is.
#include "methods/methods.h"

struct vkb_time_stages vkb_begin_time_stages(const struct vkb_settings *settings)
{
    return (struct vkb_time_stages){
        .exposure = VKB_NO_IMAGE,
        .exposes_bloom = vkb_exposure_has(settings, EXPOSES_BLOOM),
        .exposes_picture = vkb_exposure_has(settings, EXPOSES_PICTURE),
        .exposes_first = vkb_exposure_has(settings, EXPOSES_FIRST),
        .meters_bloom = vkb_exposure_has(settings, METERS_BLOOM),
        .resolves_scene = settings->taa_engine && !settings->taa_after,
        .resolves_picture = settings->taa_engine && settings->taa_after,
        .taa = {VKB_NO_IMAGE, VKB_NO_IMAGE, VKB_NO_IMAGE, false, VKB_NO_IMAGE},
    };
}

static void expose(struct vkb_levels *levels, struct vkb_time_stages *stages, uint32_t *scene,
                   uint32_t *glow)
{
    const bool one = *scene == *glow;

    if (levels->settings->exposure_engine && !stages->meters_bloom)
        stages->exposure = vkb_add_exposure(levels, *scene);
    if (!stages->exposes_bloom)
        return;
    *scene = vkb_add_exposed(levels, "exposed", true, *scene, stages->exposure, false);
    *glow = one
              ? *scene
              : vkb_add_exposed(levels, "exposed_emission", false, *glow, stages->exposure, false);
}

static void resolve(struct vkb_levels *levels, struct vkb_time_stages *stages, uint32_t *scene,
                    uint32_t *glow)
{
    const bool one = *scene == *glow;

    if (!stages->resolves_scene)
        return;
    *scene = vkb_add_taa(levels, &stages->taa, *scene, "");
    if (one)
        *glow = *scene;
    else if (stages->resolves_glow)
        *glow = vkb_add_taa(levels, &stages->taa, *glow, "_glow");
}

void vkb_add_time_stages_before(struct vkb_levels *levels, struct vkb_time_stages *stages,
                                uint32_t *scene, uint32_t *glow)
{
    if (stages->exposes_first)
        expose(levels, stages, scene, glow);
    resolve(levels, stages, scene, glow);
    if (!stages->exposes_first)
        expose(levels, stages, scene, glow);
}

void vkb_add_time_stages_after(struct vkb_levels *levels, struct vkb_time_stages *stages,
                               struct vkb_composite_source *source)
{
    const bool has_bloom = source->bloom != VKB_NO_IMAGE || levels->picture;

    if (!stages->exposes_picture && !stages->resolves_picture)
        return;
    uint32_t picture = has_bloom ? vkb_add_combining_pass(levels, source) : source->scene;
    if (stages->resolves_picture)
        picture = vkb_add_taa(levels, &stages->taa, picture, "");
    if (stages->meters_bloom)
        stages->exposure = vkb_add_exposure(levels, picture);
    if (stages->exposes_picture)
        picture =
            vkb_add_exposed(levels, "exposed_picture", false, picture, stages->exposure, true);
    *source = (struct vkb_composite_source){
        .scene = picture,
        .bloom = VKB_NO_IMAGE,
        .mask = VKB_NO_IMAGE,
    };
    levels->picture = 0;
}
