#include "methods/methods.h"
#include "passes/levels.h"

#include <string.h>

static uint32_t (*const methods[VKB_METHOD_COUNT])(struct vkb_levels *) = {
#define METHOD_ROW(constant, name, ...) [VKB_METHOD_##constant] = vkb_add_##name##_method,
    VKB_METHODS(METHOD_ROW)
#undef METHOD_ROW
};

uint32_t vkb_add_bloom(struct vkb_levels *levels, const struct vkb_bloom_source *source)
{
    uint32_t stages[MAX_STAGES];

    if (levels->failed)
        return VKB_NO_IMAGE;
    levels->source = source;
    if (vkb_has_glare(levels->settings))
        vkb_add_glare_stages(levels, stages);
    const uint32_t bloom = methods[levels->settings->method](levels);
    const uint32_t light =
        vkb_has_glare(levels->settings)
            ? vkb_add_light_passes(levels, stages, levels->picture ? VKB_NO_IMAGE : bloom)
            : bloom;
    levels->source = NULL;  // the caller's
    return light;
}

bool vkb_check_sizes(const struct vkb_settings *settings, const char *name, struct vkb_size frame,
                     uint32_t max_side, struct vkb_error *error)
{
    return vkb_check_size(name, frame.width, frame.height, max_side, error)
        && (!settings->bloom_width
            || vkb_check_size("bloom_size", settings->bloom_width, settings->bloom_height, max_side,
                              error));
}

struct vkb_size vkb_bloom_size(const struct vkb_settings *settings, struct vkb_size frame)
{
    if (settings->bloom_width)
        return (struct vkb_size){settings->bloom_width, settings->bloom_height};
    return (struct vkb_size){
        .width = vkb_scaled(frame.width, settings->values.bloom_scale),
        .height = vkb_scaled(frame.height, settings->values.bloom_scale),
    };
}
