// The graphs, as rows: a source (a scene, an image) and a method of blurring its glow.
#ifndef VKB_METHODS_H
#define VKB_METHODS_H

#include "graph/graph.h"
#include "methods/settings.h"
#include "scene/scene.h"

struct vkb_size {
    uint32_t width, height;
};

// A frame of a scene.
struct vkb_scene_source {
    struct vkb_camera camera;
    double time;
    struct vkb_size size;
    double glow_intensity;
    bool has_sky, has_glow, has_emission;  // the body's materials emit
    bool body_textured, glow_textured;     // some of the mesh's triangles have textures
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

// Whether the sizes that all others of a graph follow from are within 1 and max_side: asked before
// a graph is built, where sizes that follow from longer sides would not fit 32 bits. `name` is what
// the caller knows the frame by.
bool vkb_check_sizes(const struct vkb_settings *settings, const char *name, struct vkb_size frame,
                     uint32_t max_side, struct vkb_error *error);

// The graph of a scene in the shading of that name.
bool vkb_build_scene(const char *shading, const struct vkb_settings *settings,
                     const struct vkb_scene_source *source, struct vkb_graph *graph,
                     struct vkb_error *error);
bool vkb_build_forward(const struct vkb_settings *settings, const struct vkb_scene_source *source,
                       struct vkb_graph *graph, struct vkb_error *error);
bool vkb_build_deferred(const struct vkb_settings *settings, const struct vkb_scene_source *source,
                        struct vkb_graph *graph, struct vkb_error *error);

// What every draw of a frame of the scene has in its parameters.
struct vkb_mesh_params vkb_scene_params(const struct vkb_scene_source *source);

// The glow mesh into the images "glow" and "glow_depth"; the colours pass the threshold of that
// mode.
bool vkb_add_glow(const struct vkb_settings *settings, const struct vkb_scene_source *source,
                  const struct vkb_mesh_params *params, enum vkb_format format,
                  struct vkb_size size, bool framebuffer, enum vkb_mode threshold,
                  struct vkb_graph *graph, uint32_t *glow, struct vkb_error *error);

// A row that draws a mesh or the sky, with a depth test; the caller fills in further targets.
struct vkb_pass_row vkb_scene_row(const char *name, enum vkb_geometry geometry,
                                  enum vkb_shader fragment, uint32_t target, uint32_t depth,
                                  const struct vkb_mesh_params *params);

// The row, which draws a mesh, and where some of its triangles have textures a second one, which
// draws those with that fragment shader.
bool vkb_add_mesh(const struct vkb_pass_row *row, bool has_textures, enum vkb_shader textured,
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

// The format of what a method starts from and of the bloom, for bloom buffers of that format: of
// the R11G11B10 of engines only the levels are, the frame before and after has a format of its own.
enum vkb_format vkb_end_format(const struct vkb_settings *settings, enum vkb_format buffers);

// The last pass: `scene` and `bloom` (VKB_NO_IMAGE: none) to the framebuffer "final", of that
// format and with the scene's channels.
bool vkb_add_composite(const struct vkb_settings *settings, uint32_t scene, uint32_t bloom,
                       enum vkb_format format, struct vkb_graph *graph, struct vkb_error *error);

// An image that a pass will write.
bool vkb_add_target(struct vkb_graph *graph, const char *name, enum vkb_format format,
                    struct vkb_size size, bool framebuffer, uint32_t *index,
                    struct vkb_error *error);

// A pass that reduces `image` to the size of `glow` and keeps what the threshold lets through.
bool vkb_add_extract(const struct vkb_settings *settings, uint32_t image, uint32_t glow,
                     struct vkb_graph *graph, struct vkb_error *error);

enum vkb_mode vkb_threshold_mode(const struct vkb_settings *settings);

// The bloom buffers' size: fixed, or a floored part of the frame, never under 1 a side.
struct vkb_size vkb_bloom_size(const struct vkb_settings *settings, struct vkb_size frame);

// What SAMPLING_ROWS hold for a pass that writes `target`.
struct vkb_sampling {
    int width, height;
    float limit;
};
struct vkb_sampling vkb_sampling_into(const struct vkb_graph *graph, uint32_t target);

bool vkb_same_size(const struct vkb_graph *graph, uint32_t a, uint32_t b);

// A row with the defaults of a fullscreen pass; the caller fills in the rest.
struct vkb_pass_row vkb_fullscreen_row(const char *name, enum vkb_shader fragment, uint32_t target);

#endif
