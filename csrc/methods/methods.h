// Builds the graph of a source (a scene or an image) and a method that blurs its glow.
#ifndef VKB_METHODS_H
#define VKB_METHODS_H

#include "passes/composite.h"
#include "passes/scene.h"
#include "passes/threshold.h"

// An image from the host. An emission has its size and format, a mask its size; both are optional.
struct vkb_image_source {
    enum vkb_format format;
    struct vkb_size size;
    uint32_t channels;  // 3 or 4
    uint32_t layers;    // of a batch; 0: it is one image
    bool has_emission, has_mask;
    bool has_motion, has_depth;  // for temporal anti-aliasing
    // Images that another part of the graph has made.
    struct vkb_level {
        enum vkb_format format;
        struct vkb_size size;
    } levels[GATHERED_LEVELS];
    uint32_t level_count;
};

// Checks that the sizes from which a graph derives all others are 1 to max_side. It is called
// before a graph is built, since sizes derived from longer sides may not fit 32 bits. `name` is the
// name of the frame in the message.
bool vkb_check_sizes(const struct vkb_settings *settings, const char *name, struct vkb_size frame,
                     uint32_t max_side, struct vkb_error *error);

// The graph of each kind of source.
void vkb_build_forward(struct vkb_levels *levels, const struct vkb_scene_source *source);
void vkb_build_deferred(struct vkb_levels *levels, const struct vkb_scene_source *source);
void vkb_build_image(struct vkb_levels *levels, const struct vkb_image_source *image);
// The size of the bloom buffers of a forward scene.
struct vkb_size vkb_forward_buffers(const struct vkb_settings *settings, struct vkb_size frame);

// Whether the settings have glare that is added to the bloom.
bool vkb_has_glare(const struct vkb_settings *settings);

// Adds the rows of the stages of glare to the graph; `stages` gets the image of each.
void vkb_add_glare_stages(struct vkb_levels *levels, uint32_t *stages);
// Adds the sum of the bloom (VKB_NO_IMAGE: none) and the stages, each times its intensity. Returns
// this image.
uint32_t vkb_add_light_passes(struct vkb_levels *method, const uint32_t *stages, uint32_t bloom);

// Adds an iteration of a ray of streaks from `from`, with the numbers of a stage, into the image
// `to`. `before`, if there is one, is added. `gain` is the sum of the taps' weights. `next`, if
// there is one, has the bits of next_texel() for each tap.
struct vkb_ray {
    const struct vkb_glare_values *values;
    double angle, gain;
    const float (*next)[4];
    int iteration;
    uint32_t from, before, to;
};
void vkb_add_ray_pass(struct vkb_levels *levels, const struct vkb_ray *ray);

// Adds the ghosts of a stage of `from` into the image `to`. `before`, if there is one, is added.
void vkb_add_flare_pass(struct vkb_levels *levels, const struct vkb_stage *stage, uint32_t from,
                        uint32_t before, uint32_t to);

// Adds the rows of the method that the settings name, and those of glare. Returns the last image.
uint32_t vkb_add_bloom(struct vkb_levels *levels, const struct vkb_bloom_source *source);

// Adds what meters an image, and the image "exposure", which has what the exposure adapts to and
// its multipliers. Returns this image.
uint32_t vkb_add_exposure(struct vkb_levels *levels, uint32_t metered);
// Adds an image times the multiplier before the bloom, or with `after` times the one after it.
uint32_t vkb_add_exposed(struct vkb_levels *levels, const char *name, bool framebuffer,
                         uint32_t image, uint32_t exposure, bool after);
// Whether the settings have an exposure with one of EXPOSES_* or METERS_BLOOM.
bool vkb_exposure_has(const struct vkb_settings *settings, uint32_t what);

// The images of the motion along x and y, and of the depth; VKB_NO_IMAGE: none is given. `packed`:
// the first one has all of them as its channels.
struct vkb_taa_inputs {
    uint32_t motion_x, motion_y, depth;
    bool packed;
    uint32_t last_motion;  // of the frame before; VKB_NO_IMAGE: there is none, or none yet
};
// Adds the temporal anti-aliasing of the settings: "history", what is kept for the next frame, and
// "resolved", the light of this, which it returns. `what` is added to both names.
uint32_t vkb_add_taa(struct vkb_levels *levels, struct vkb_taa_inputs *inputs, uint32_t image,
                     const char *what);

// The stages in time around a bloom: an exposure, of what the bloom reads or of the picture with
// its bloom, and temporal anti-aliasing of one of these.
struct vkb_time_stages {
    uint32_t exposure;  // with the multipliers; VKB_NO_IMAGE: there is none, or none yet
    bool exposes_bloom, exposes_picture, exposes_first, meters_bloom;
    bool resolves_scene, resolves_picture;
    bool resolves_glow;  // what glows is resolved, too, where it is not the scene
    struct vkb_taa_inputs taa;
};
struct vkb_time_stages vkb_begin_time_stages(const struct vkb_settings *settings);
// Meters and resolves the scene, and replaces the scene and what glows by images that are resolved
// and exposed.
void vkb_add_time_stages_before(struct vkb_levels *levels, struct vkb_time_stages *stages,
                                uint32_t *scene, uint32_t *glow);
// Combines scene and bloom, resolves and exposes the picture, which is then the scene without a
// bloom.
void vkb_add_time_stages_after(struct vkb_levels *levels, struct vkb_time_stages *stages,
                               struct vkb_composite_source *source);

// Each method adds its rows, and returns the last image.
#define VKB_METHOD_FUNCTION(constant, name, ...) \
    uint32_t vkb_add_##name##_method(struct vkb_levels *levels);
VKB_METHODS(VKB_METHOD_FUNCTION)
#undef VKB_METHOD_FUNCTION

// The size of the bloom buffers: fixed, or a part of the frame, floored, but at least 1 on each
// side.
struct vkb_size vkb_bloom_size(const struct vkb_settings *settings, struct vkb_size frame);

#endif
