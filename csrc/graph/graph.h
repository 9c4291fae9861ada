// A graph as data: the images and the passes of one frame. Rows are plain values; barriers,
// layouts, render passes and descriptor sets follow from them.
#ifndef VKB_GRAPH_H
#define VKB_GRAPH_H

#include "graph/params.h"
#include "spirv.h"
#include "vulkan/barrier.h"
#include "vulkan/format.h"

enum {
    VKB_NAME_SIZE = 32,
    VKB_MAX_READS = GATHERED_LEVELS,
    // As storage images. With the target one less than the four that every device can bind.
    VKB_MAX_LOADS = 2,
    VKB_MAX_TARGETS = 4,
};

#define VKB_NO_IMAGE UINT32_MAX

// An image is written by one run of passes that follow each other, or is the input; so what it
// holds stays right until that run is out of date.
struct vkb_image_row {
    char name[VKB_NAME_SIZE];
    enum vkb_format format;
    uint32_t width, height;
    uint32_t channels;  // that come back to the host; 0: all
    bool framebuffer;   // one of the frame's results, not only a step towards them
    bool input;         // filled by the host, not by a pass
};

// What a pass draws; the depth test and the culling follow from it. A dispatch draws nothing: a
// compute shader writes the one target, a block of pixels each workgroup.
enum vkb_geometry {
    VKB_GEOMETRY_FULLSCREEN,
    VKB_GEOMETRY_SKYBOX,
    VKB_GEOMETRY_BODY,
    VKB_GEOMETRY_GLOW,
    VKB_GEOMETRY_DISPATCH,
};

static inline bool vkb_is_mesh(enum vkb_geometry geometry)
{
    return geometry == VKB_GEOMETRY_BODY || geometry == VKB_GEOMETRY_GLOW;
}

enum vkb_load { VKB_LOAD_DISCARD, VKB_LOAD_CLEAR };
enum vkb_blend { VKB_BLEND_NONE, VKB_BLEND_ADD };

// Bindings: 0 the parameter block, then the images read in their order, then the target of a
// dispatch; a skybox reads the scene's cubemap at binding 1, textured triangles the base colour's
// texture and the emission's. Passes that draw and follow each other with the same targets share a
// render pass; the first one's load op counts.
struct vkb_pass_row {
    char name[VKB_NAME_SIZE];
    enum vkb_geometry geometry;
    bool textured;  // draws the mesh's triangles that have textures, not those that have none
    enum vkb_shader vertex, shader;  // a dispatch has no vertex shader
    struct vkb_constants constants;
    uint32_t reads[VKB_MAX_READS];
    uint32_t read_count;
    bool loads;        // a dispatch that reads storage images, without a sampler
    bool alternative;  // may run in place of the pass before it, which has the same target
    uint32_t block_width, block_height;  // of a dispatch: the pixels that a workgroup writes
    uint32_t targets[VKB_MAX_TARGETS];
    uint32_t target_count;
    uint32_t depth;  // VKB_NO_IMAGE: none
    enum vkb_load load;
    enum vkb_blend blend;
    enum vkb_block block;
    union vkb_params params;
};

struct vkb_graph {
    struct vkb_image_row *images;
    struct vkb_pass_row *passes;
    uint32_t image_count, pass_count;
    size_t image_capacity, pass_capacity;
};

void vkb_graph_destroy(struct vkb_graph *graph);

// Adds a copy of the row; *index (may be NULL) is where it lies.
bool vkb_graph_add_image(struct vkb_graph *graph, const struct vkb_image_row *row, uint32_t *index,
                         struct vkb_error *error);
bool vkb_graph_add_pass(struct vkb_graph *graph, const struct vkb_pass_row *row,
                        struct vkb_error *error);

// Every rule that the rows must keep, so that nothing but a right graph reaches Vulkan.
bool vkb_graph_check(const struct vkb_graph *graph, uint32_t max_side, struct vkb_error *error);

// Whether both sides are within 1 and max_side; `name` is what the message calls them.
bool vkb_check_size(const char *name, uint32_t width, uint32_t height, uint32_t max_side,
                    struct vkb_error *error);

// Whether both have the same images, in the same order; their passes may differ.
bool vkb_graph_same_images(const struct vkb_graph *a, const struct vkb_graph *b);

// The index after the last pass that shares a render pass with pass `first`.
uint32_t vkb_graph_group_end(const struct vkb_graph *graph, uint32_t first);

// Writes all that the row says to `bytes`, which has room for a row, field by field: two rows say
// the same where these bytes are equal. (The rows themselves have padding.) Returns how many.
size_t vkb_pass_pack(const struct vkb_pass_row *pass, unsigned char *bytes);

bool vkb_pass_writes(const struct vkb_pass_row *pass, uint32_t image);

// Whether a pass blends what it draws with what the image holds.
bool vkb_graph_blends(const struct vkb_graph *graph, uint32_t image);

// How a pass reads its images.
enum vkb_access vkb_pass_reads_as(const struct vkb_pass_row *pass);

// Where an image rests between frames: as its first reader reads it, else ready to be copied out;
// depth that no pass reads stays an attachment.
enum vkb_access vkb_graph_rest(const struct vkb_graph *graph, uint32_t image);

// How the passes first..end-1 use their targets: the colours in order, then the depth.
uint32_t vkb_graph_target_uses(const struct vkb_graph *graph, uint32_t first, uint32_t end,
                               struct vkb_target_use *uses);

// The channels of the image that come back to the host.
uint32_t vkb_graph_channels(const struct vkb_graph *graph, uint32_t image);

// The framebuffer of that name, VKB_NO_IMAGE where the graph has none.
uint32_t vkb_graph_find(const struct vkb_graph *graph, const char *name);

#endif
