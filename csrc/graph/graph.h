// A graph as data: the images and the passes of one frame. Rows are plain values. Barriers,
// layouts, attachments and descriptor sets are derived from them.
#ifndef VKB_GRAPH_H
#define VKB_GRAPH_H

#include "graph/filter.h"
#include "graph/resource.h"
#include "spirv.h"
#include "vulkan/barrier.h"
#include "vulkan/format.h"

enum {
    VKB_NAME_SIZE = 32,
    VKB_MAX_READS = 16,                       // as many as every device can sample
    VKB_MAX_LINEAR_TEXELS = GATHERED_LEVELS,  // images that are read as linear texels
    // Storage images. With the target, one less than the four that every device supports.
    VKB_MAX_LOADS = 2,
    // Of a dispatch; a draw has as many as the device has attachments.
    VKB_MAX_TARGETS = 16,
    VKB_MAX_HISTORIES = 8,
    // That a method brings along, and that a pass binds.
    VKB_MAX_RESOURCES = 16,
    // Of a pass, beside its parameters.
    VKB_MAX_DESCRIPTORS = VKB_MAX_READS + VKB_MAX_RESOURCES + VKB_MAX_TARGETS,
};

#define VKB_NO_IMAGE UINT32_MAX

typedef char vkb_image_name[VKB_NAME_SIZE];

// Copies as much of a text as there is space for. (With snprintf a plan takes 1.3 times as long:
// libquadmath, which NumPy loads, registers a format, and glibc then parses each one slowly.)
void vkb_set_name(char *name, size_t size, const char *text);

// The name of an image that is no framebuffer begins with this. Framebuffers of custom methods are
// named by users, who cannot write it.
#define VKB_INTERNAL_NAME '.'

// Which of its data the host writes to an image: the image of a source, its emission, its mask, its
// motion along both axes, its depth, an image that another part of the graph has made, or what a
// call before has made.
enum vkb_input_kind {
    VKB_INPUT_NONE,
    VKB_INPUT_IMAGE,
    VKB_INPUT_EMISSION,
    VKB_INPUT_MASK,
    VKB_INPUT_MOTION_X,
    VKB_INPUT_MOTION_Y,
    VKB_INPUT_DEPTH,
    VKB_INPUT_LEVEL,
    VKB_INPUT_HISTORY = VKB_INPUT_LEVEL + GATHERED_LEVELS,
    VKB_INPUT_COUNT = VKB_INPUT_HISTORY + VKB_MAX_HISTORIES,
};

// Whether it has one channel of single floats, whatever the image has; it is no light, so that its
// NaN and infinity are not counted.
static inline bool vkb_is_grey(enum vkb_input_kind kind)
{
    return kind >= VKB_INPUT_MASK && kind < VKB_INPUT_LEVEL;
}

// FNV-1a by words of 64 bits.
#define VKB_HASH_START UINT64_C(0xcbf29ce484222325)
static inline uint64_t vkb_hash_word(uint64_t hash, uint64_t word)
{
    return (hash ^ word) * UINT64_C(0x100000001b3);
}

// An image is either given by the host, or written by one sequence of consecutive passes. So its
// content stays valid until this sequence is out of date.
struct vkb_image_row {
    char name[VKB_NAME_SIZE];
    enum vkb_format format;
    uint32_t width, height;
    uint32_t layers;    // of a batch; 0: it is no array
    uint32_t channels;  // that are read back; 0: all
    bool framebuffer;   // one of the frame's results, not an intermediate image
    enum vkb_input_kind input;
    uint32_t history_of;      // of VKB_INPUT_HISTORY: the framebuffer (vkb_graph_add_history)
    VkImageUsageFlags usage;  // that the graph's passes need (vkb_graph_set_usages)
    // Filled by the host once: the pixels, without gaps (NULL: zeros), and their number; 0: it is
    // not. A history holds them if no call before has made it. Grey ones of single floats are one
    // float each, which all channels have.
    const void *pixels;
    bool grey;
    uint64_t serial;
};

// Whether the host fills the image, not a pass.
static inline bool vkb_is_given(const struct vkb_image_row *row)
{
    return row->input || row->serial;
}

// What a bloom is made from, with NaN and infinity.
static inline bool vkb_is_of_source(const struct vkb_image_row *row)
{
    return row->input == VKB_INPUT_IMAGE || row->input == VKB_INPUT_EMISSION;
}

static inline bool vkb_is_history(const struct vkb_image_row *row)
{
    return row->input >= VKB_INPUT_HISTORY;
}

// What a pass draws; depth test and culling are derived from it. A dispatch draws nothing: its
// compute shader writes one target, and each workgroup writes one block of pixels.
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

// How a pass reads its images. A dispatch writes its target in the same way, except that a pass
// that reads sampled images writes a storage image.
enum vkb_reading {
    VKB_READING_SAMPLED,
    VKB_READING_LOADED,         // as storage images
    VKB_READING_LINEAR_TEXELS,  // as buffers of 16-byte words, on devices that share images with
                                // the host
};

// How a sampler reads an image: filtered where the device can, and clamped to the edge; or as these
// bits say. What is beyond the edge is repeated, mirrored, or zero.
enum {
    VKB_SAMPLING_NEAREST = 1,
    VKB_SAMPLING_REPEAT = 2,
    VKB_SAMPLING_MIRROR = 4,
    VKB_SAMPLING_ZERO = 6,
    VKB_SAMPLINGS = 8,
};

enum vkb_load { VKB_LOAD_DISCARD, VKB_LOAD_CLEAR };
enum vkb_blend {
    VKB_BLEND_NONE,
    VKB_BLEND_ADD,  // the colours; the target keeps its alpha
    VKB_BLEND_ADD_RGBA,
};

// The pixels of an image in the host's memory: rows of single floats, `pitch` of them from one row
// to the next.
struct vkb_host_image {
    float *pixels;  // NULL: there is no image
    size_t pitch;
    uint32_t width, height;
};

struct vkb_pass_row;
struct vkb_workers;
// A pass that the host runs between two submissions, on devices whose images are in its memory.
// `reads`: by slot.
typedef bool vkb_host_pass(const struct vkb_pass_row *pass, const struct vkb_host_image *reads,
                           const struct vkb_host_image *target, struct vkb_workers *workers,
                           struct vkb_error *error);

// Of a pass of a convolution by transforms: the lengths of its lines along rows and columns,
// whether these are padded, so that they may be longer, and how many stages along the same axis
// follow each other from this one on; 0: it is not the first of them. `channels`: those that are
// convolved, also in the transpose, where the others have no cotangents.
struct vkb_transform {
    uint32_t width, height;
    bool pads_rows, pads_columns;
    uint32_t stages, channels;
};

// Bindings: 0 is the parameter block, then the images read, by slot, then the targets of a
// dispatch, of which one can be among the images read: each invocation then stores where it has
// loaded. A skybox reads the scene's cubemap at binding 1; textured triangles read the textures of
// base colour and emission. Consecutive draws with the same targets share a render pass, with the
// load operation of the first.
struct vkb_pass_row {
    char name[VKB_NAME_SIZE];
    const char *variant;  // name of the variant that replaces the method's pass; NULL: none
    enum vkb_geometry geometry;
    bool textured;  // draws the mesh's triangles that have textures, not those that have none
    const struct vkb_shader *vertex, *shader;  // a dispatch has no vertex shader
    struct vkb_constants constants;
    uint32_t reads[VKB_MAX_READS];    // by slot (SLOT_*); VKB_NO_IMAGE: the pass reads none there
    uint32_t read_count;              // slots
    uint8_t sampling[VKB_MAX_READS];  // by slot, of VKB_SAMPLING_*
    enum vkb_reading reading;
    vkb_host_pass *host;   // of a dispatch that the host runs; NULL: the device does
    bool fused;            // its group may replace the one before, with the same target
    bool gains_if_finite;  // is compiled a second time, for sources without NaN and infinity
    uint32_t block_width, block_height;    // of a dispatch: pixels of a workgroup
    uint32_t groups_width, groups_height;  // number of workgroups; 0: what covers the target
    uint32_t vertices;                     // of a draw without a mesh; 0: of one triangle
    uint32_t targets[VKB_MAX_TARGETS];
    uint32_t target_count;
    uint32_t depth;  // VKB_NO_IMAGE: none
    enum vkb_load load;
    enum vkb_blend blend;
    // Bound after the images read. Their owner outlives the row.
    const struct vkb_resource *const *resources;
    uint32_t resource_count;
    // Of a pass that changes resources, or reads changed ones: other than in the request before, so
    // that it runs in each request; 0: of no such pass.
    uint64_t turn;
    // What the pass computes, whatever shader it has: the block, or its transpose.
    enum vkb_block block;
    bool transposed;
    // Of a pass that is linear, but for points before and after: a filter for each of its first
    // images, whose sum it is. The graph owns these.
    const struct vkb_filter *filters;
    uint32_t filter_count;
    // Of the last of several passes that are a filter together: of two, each along one axis, or of
    // one for each picture that a transpose adds up. The filters of the image that the first pass
    // reads, whose sum they are.
    const struct vkb_filter *joined;
    uint32_t joined_from, joined_count;
    struct vkb_transform transform;
    union vkb_params params;
};

static inline bool vkb_computes(const struct vkb_pass_row *pass, enum vkb_block block)
{
    return pass->block == block && !pass->transposed;
}

static inline bool vkb_transposes(const struct vkb_pass_row *pass, enum vkb_block block)
{
    return pass->block == block && pass->transposed;
}

struct vkb_graph {
    struct vkb_image_row *images;
    struct vkb_pass_row *passes;
    uint32_t image_count, pass_count;
    size_t image_capacity, pass_capacity;
    void *owned;                  // pixels of an image, freed with the graph
    struct vkb_filter **filters;  // of its passes
    uint32_t filter_count;
    size_t filter_capacity;
    // Of levels whose width follows from the aspect of the frame: the adapter's limit; 0: none.
    uint32_t max_width;
    uint32_t layers;     // of a batch; 0: of one image
    bool keeps_unmoved;  // axes whose kernels are moved to texels
};

void vkb_graph_destroy(struct vkb_graph *graph);

// Adds a copy of the row; *index (may be NULL) gets its index. Puts VKB_INTERNAL_NAME before the
// name of an image that neither is a framebuffer nor comes from the source. Fails if there is an
// image of that name: caches find images by their names.
bool vkb_graph_add_image(struct vkb_graph *graph, const struct vkb_image_row *row, uint32_t *index,
                         struct vkb_error *error);
// Makes an image a framebuffer of that name.
bool vkb_graph_show_image(struct vkb_graph *graph, uint32_t image, const char *name,
                          struct vkb_error *error);

// Adds the history of a framebuffer, or finds it: an image of the same size and format that holds
// what the framebuffer was after the call before, and zeros if the call continues none
// (python/history.c). Fails if the image is no framebuffer, or has a format that images of the host
// have not.
bool vkb_graph_add_history(struct vkb_graph *graph, uint32_t image, uint32_t *index,
                           struct vkb_error *error);
// The history of an image; VKB_NO_IMAGE: it has none. What has one is made in each call.
uint32_t vkb_graph_history(const struct vkb_graph *graph, uint32_t image);

// The last pass whose only target is the image; NULL: none.
const struct vkb_pass_row *vkb_graph_writer(const struct vkb_graph *graph, uint32_t image);

// The copy's constant `stored` is that of its first target. Fails if one of its images is not
// there.
bool vkb_graph_add_pass(struct vkb_graph *graph, const struct vkb_pass_row *row,
                        struct vkb_error *error);

// A copy of filters that lives as long as the graph; NULL on failure.
const struct vkb_filter *vkb_graph_keep_filters(struct vkb_graph *graph,
                                                const struct vkb_filter *filters, uint32_t count,
                                                struct vkb_error *error);

// How shaders round what they store to an image of that format: of STORED_*.
enum vkb_mode vkb_storage_mode(enum vkb_format format);

// Checks the sizes of all images.
bool vkb_graph_check_sizes(const struct vkb_graph *graph, uint32_t max_side,
                           struct vkb_error *error);

// Checks that both sides are 1 to max_side; `name` is used in the message.
bool vkb_check_size(const char *name, uint32_t width, uint32_t height, uint32_t max_side,
                    struct vkb_error *error);

// Makes the graph that of a batch: all images get as many layers as it has, and one dispatch writes
// all layers of its target. A VALUE error where this cannot be done: of draws, of linear texels, of
// shaders without layers, and of images that the host fills for all frames.
bool vkb_graph_layer(struct vkb_graph *graph, struct vkb_error *error);

// Derives how each image is used from the passes that read and write it, and from whether the host
// fills it once or reads it. How inputs are filled is the source's business.
void vkb_graph_set_usages(struct vkb_graph *graph);

// Whether one image can have the memory of the other: same format, size and layers.
bool vkb_images_alike(const struct vkb_image_row *a, const struct vkb_image_row *b);

// Bytes of an image, and of all images that passes use, without layers.
uint64_t vkb_image_size(const struct vkb_image_row *row);

// Copies the first `channels` (all, or three) of a row of the pixels that the graph has; zeros
// without pixels.
void vkb_copy_given_row(const struct vkb_image_row *image, uint32_t y, uint32_t channels, void *to);
uint64_t vkb_graph_size(const struct vkb_graph *graph);

// Whether both graphs have the same images in the same order; their passes may differ.
bool vkb_graph_same_images(const struct vkb_graph *a, const struct vkb_graph *b);

// The index after the last pass of the group of pass `first`: of those that share a render pass,
// or that go on in place.
uint32_t vkb_graph_group_end(const struct vkb_graph *graph, uint32_t first);

// Writes the fields of the row to `bytes`, which has space for a row, without padding. Two rows are
// equal if these bytes are equal. Returns the number of bytes.
size_t vkb_pass_pack(const struct vkb_pass_row *pass, unsigned char *bytes);

bool vkb_pass_reads(const struct vkb_pass_row *pass, uint32_t image);
// Whether the pass reads an image at that slot which it does not write.
bool vkb_pass_needs(const struct vkb_pass_row *pass, uint32_t slot);
// Whether the pass is a dispatch that reads and writes one image. It is in the group of the pass
// before, which writes that image.
bool vkb_pass_in_place(const struct vkb_pass_row *pass);
bool vkb_pass_writes(const struct vkb_pass_row *pass, uint32_t image);

// The images that a pass writes, the depth last, into an array of VKB_MAX_TARGETS + 1. Returns
// their number.
uint32_t vkb_pass_targets(const struct vkb_pass_row *pass, uint32_t *targets);

// How users see the name of an image or of a pass: without VKB_INTERNAL_NAME, where no image of the
// graph has that name.
const char *vkb_graph_label(const struct vkb_graph *graph, const char *name);

// The name under which the group of passes from `first` on is timed: for a render pass the first
// image that it writes, for a dispatch its own name.
const char *vkb_graph_timed_as(const struct vkb_graph *graph, uint32_t first);

// Whether a pass draws to the image with blending.
bool vkb_graph_blends(const struct vkb_graph *graph, uint32_t image);

// How a pass reads its images.
enum vkb_access vkb_pass_reads_as(const struct vkb_pass_row *pass);

// The channels of the image that are read back.
uint32_t vkb_graph_channels(const struct vkb_graph *graph, uint32_t image);

// The image of that name; VKB_NO_IMAGE if there is none.
uint32_t vkb_graph_find(const struct vkb_graph *graph, const char *name);

#endif
