// The graphs, as rows: a source (a scene, an image) and a method of blurring its glow.
#ifndef VKB_METHODS_H
#define VKB_METHODS_H

#include "graph.h"
#include "scene.h"
#include "settings.h"

struct vkb_size {
    uint32_t width, height;
};

// A frame of a scene, forward shading.
struct vkb_forward {
    struct vkb_camera camera;
    double time;
    struct vkb_size size;
    bool has_sky;
};

// An image from the host.
struct vkb_image_source {
    enum vkb_format format;
    struct vkb_size size;
    uint32_t channels;  // 3 or 4
};

// What a method's rows start from: the glow image and the format of the bloom buffers; they end in
// an image "bloom" of the final size.
struct vkb_bloom_source {
    uint32_t glow;
    struct vkb_size buffers, final;
    enum vkb_format format;
};

bool vkb_build_forward(const struct vkb_settings *settings, const struct vkb_forward *forward,
                       struct vkb_graph *graph, struct vkb_error *error);

bool vkb_build_image(const struct vkb_settings *settings, const struct vkb_image_source *image,
                     struct vkb_graph *graph, struct vkb_error *error);

// The rows of the method that the settings name; *bloom is the image that they end in.
bool vkb_add_bloom(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                   struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error);
#define VKB_METHOD_FUNCTION(constant, name, published) \
    bool vkb_add_##name(const struct vkb_settings *settings, \
                        const struct vkb_bloom_source *source, struct vkb_graph *graph, \
                        uint32_t *bloom, struct vkb_error *error);
VKB_METHODS(VKB_METHOD_FUNCTION)
#undef VKB_METHOD_FUNCTION

bool vkb_is_published(const struct vkb_settings *settings);

// The last pass: `scene` and `bloom` (VKB_NO_IMAGE: none) to the framebuffer "final", which has the
// scene's format and channels.
bool vkb_add_composite(const struct vkb_settings *settings, uint32_t scene, uint32_t bloom,
                       struct vkb_graph *graph, struct vkb_error *error);

enum vkb_mode vkb_threshold_mode(const struct vkb_settings *settings);

// The bloom buffers' size: fixed, or a floored part of the frame, never under 1 a side.
struct vkb_size vkb_bloom_size(const struct vkb_settings *settings, struct vkb_size frame);

// Source texels a target pixel, and the largest value that the target holds.
struct vkb_sampling {
    float ratio_x, ratio_y, limit;
};
struct vkb_sampling vkb_sampling_between(const struct vkb_graph *graph, uint32_t source,
                                         uint32_t target);

// A row with the defaults of a fullscreen pass; the caller fills in the rest.
struct vkb_pass_row vkb_fullscreen_row(const char *name, enum vkb_shader fragment, uint32_t target);

#endif
