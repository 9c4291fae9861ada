// Shared by the rows of all passes.
#ifndef VKB_PASS_H
#define VKB_PASS_H

#include "graph/graph.h"
#include "passes/settings.h"

struct vkb_size {
    uint32_t width, height;
};

// The input of a method: the glow image, and sizes and format of the bloom buffers. The method's
// last image is "bloom" with the final size.
struct vkb_bloom_source {
    uint32_t scene;  // the frame; VKB_NO_IMAGE: not there yet
    uint32_t glow;
    uint32_t mask;     // multiplies the thresholded image; VKB_NO_IMAGE: none
    bool blurs_alpha;  // alpha is a fourth channel of the bloom
    struct vkb_size buffers, final;
    enum vkb_format format;
};

// A shader that is compiled once for each format that it loads.
#define VKB_BY_FORMAT(shader) {VKB_BUFFER_FORMATS(VKB_SHADER_OF_FORMAT, shader)}
#define VKB_SHADER_OF_FORMAT(shader, format, texels, stored, ...) \
    [VKB_FORMAT_##format] = &vkb_shader_##shader##_##texels,

// Adds an image that a pass will write.
bool vkb_add_target_image(struct vkb_graph *graph, const char *name, enum vkb_format format,
                          struct vkb_size size, bool framebuffer, uint32_t *index,
                          struct vkb_error *error);

// The formats of a method's first image and of its bloom, for bloom buffers of this format.
// Published methods store only their levels in R11G11B10, and read the frame from sRGB, too.
enum vkb_format vkb_first_format(const struct vkb_settings *settings, enum vkb_format buffers);
enum vkb_format vkb_end_format(const struct vkb_settings *settings, enum vkb_format buffers);

// Sets what block B has of SAMPLING_ROWS for a pass that writes `image`.
#define VKB_SET_TARGET(row, B, image) \
    do { \
        const struct vkb_image_row *const set_target = (image); \
        (row)->params.B.target_width = (int)set_target->width; \
        (row)->params.B.target_height = (int)set_target->height; \
    } while (0)

struct vkb_size vkb_size_of(const struct vkb_graph *graph, uint32_t image);
bool vkb_same_size(const struct vkb_graph *graph, uint32_t a, uint32_t b);

// A row with the defaults of a fullscreen pass; the caller fills in the rest.
struct vkb_pass_row vkb_fullscreen_row(const char *name, const struct vkb_shader *fragment,
                                       uint32_t target);

// Makes a pass read the mask; VKB_NO_IMAGE: no mask.
void vkb_apply_mask(struct vkb_pass_row *row, uint32_t mask);

// Makes a pass read an image at a slot (VKB_NO_IMAGE: none), beside those that it reads; or at
// SLOT_SOURCE alone.
void vkb_read_at(struct vkb_pass_row *row, enum vkb_slot slot, uint32_t image);
void vkb_read_only(struct vkb_pass_row *row, uint32_t source);

// What a graph is built with. After a failure all functions of it do nothing, and an image that
// they return is the first one. The source is there while a method adds its rows.
struct vkb_levels {
    const struct vkb_settings *settings;
    const struct vkb_bloom_source *source;
    struct vkb_graph *graph;
    struct vkb_error *error;
    bool failed;
    struct vkb_size sizes[MAX_LEVELS];
    uint32_t downs[MAX_LEVELS];
    uint32_t count;
    uint32_t
        picture;   // that a custom method has written; 0: none, since that image is the source's
    double below;  // the factor of the smaller level while levels are added up
};

// An image of what Python gives: a kernel, a picture of dirt, the mask of a meter.
struct vkb_image_row vkb_given_image(const char *name, const struct vkb_kernel_data *data);

// Adds an image that has pixels; an image that passes write.
uint32_t vkb_levels_add(struct vkb_levels *levels, const struct vkb_image_row *row);
uint32_t vkb_levels_target(struct vkb_levels *levels, const char *name, enum vkb_format format,
                           struct vkb_size size, bool framebuffer);

// Adds the first image of the bloom: the framebuffer "glow", or what the method's row has instead
// (Blender's highlights are its "glow").
uint32_t vkb_add_first_image(struct vkb_levels *levels, enum vkb_format format,
                             struct vkb_size size, bool framebuffer);

// Adds a framebuffer in the format of the bloom buffers, with a name as printf() writes it.
__attribute__((format(printf, 3, 4))) uint32_t vkb_levels_image(struct vkb_levels *levels,
                                                                struct vkb_size size,
                                                                const char *format, ...);

// The history of a framebuffer: what it was after the call before (vkb_graph_add_history).
uint32_t vkb_levels_history(struct vkb_levels *levels, uint32_t image);

// Adds the image of a level, `levels->downs[level]`.
uint32_t vkb_levels_down(struct vkb_levels *levels, uint32_t level);

// As vkb_levels_image, for an intermediate image, which is not a framebuffer.
__attribute__((format(printf, 3, 4))) uint32_t vkb_levels_step(struct vkb_levels *levels,
                                                               struct vkb_size size,
                                                               const char *format, ...);

// Gives a linear pass its filters, one for each of its first images. The row before a pass along
// the other axis, whose result only this one reads: both are a filter along both axes.
void vkb_set_filters(struct vkb_levels *levels, struct vkb_pass_row *row,
                     const struct vkb_filter *filters, uint32_t count);
void vkb_join(struct vkb_levels *levels, const struct vkb_pass_row *first,
              struct vkb_pass_row *second);

// Adds a pass.
void vkb_levels_pass(struct vkb_levels *levels, const struct vkb_pass_row *row);

// Adds a pass with the prefilter's block, whose result the mask of the source multiplies, if there
// is one.
void vkb_levels_masked(struct vkb_levels *levels, struct vkb_pass_row *row);

// The image "bloom", of the final size.
uint32_t vkb_levels_bloom(struct vkb_levels *levels);

#endif
