// The settings of a request in C: filled by arguments.c, read by the functions that make rows.
#ifndef VKB_SETTINGS_H
#define VKB_SETTINGS_H

#include "graph/graph.h"

// Every method: METHOD(name in C, name in Python and of its vkb_add_ function, published). A
// published method starts from the complete frame: it reduces and thresholds in its own way.
#define VKB_METHODS(METHOD) \
    METHOD(SEPARABLE, separable, false) \
    METHOD(PYRAMID, pyramid, false) \
    METHOD(DUAL_KAWASE, dual_kawase, false) \
    METHOD(CONVOLUTION, convolution, false) \
    METHOD(BEVY, bevy, true) \
    METHOD(KINO, kino, true) \
    METHOD(FILAMENT, filament, true) \
    METHOD(URP, urp, true) \
    METHOD(HDRP, hdrp, true) \
    METHOD(THREE, three, true) \
    METHOD(GODOT, godot, true) \
    METHOD(BLENDER, blender, true) \
    METHOD(PYGFX, pygfx, true) \
    METHOD(POST_PROCESSING, post_processing, true) \
    METHOD(UNREAL, unreal, true) \
    METHOD(HALATION, halation, true) \
    METHOD(PMNDRS, pmndrs, true) \
    METHOD(BABYLON, babylon, true) \
    METHOD(PLAYCANVAS, playcanvas, true) \
    METHOD(DARKTABLE, darktable, true) \
    METHOD(CUSTOM, custom, false)

enum vkb_method {
#define VKB_METHOD_ENUM(constant, name, published) VKB_METHOD_##constant,
    VKB_METHODS(VKB_METHOD_ENUM)
#undef VKB_METHOD_ENUM
        VKB_METHOD_COUNT,
};

struct vkb_layer {
    float scale, strength;
};

// The kernel of a convolution in pixels of the bloom buffers: four floats each, row by row, which
// the owner of the settings keeps.
struct vkb_kernel_data {
    const float *pixels;
    uint32_t width, height;
    uint64_t serial;     // equal only for equal pixels
    bool grey;           // all channels are equal
    float prefilter[3];  // min, max, factor; min above max: none
};

// Every stage of glare: STAGE(name in C, name in Python, of its framebuffer and of its vkb_add_
// function). Dirt is a stage without a framebuffer: it changes the sum of the others.
#define VKB_STAGES(STAGE) \
    STAGE(STREAKS, streaks) \
    STAGE(GHOSTS, ghosts) \
    STAGE(HALO, halo) \
    STAGE(DIRT, dirt)

enum vkb_stage_kind {
#define VKB_STAGE_ENUM(constant, name) VKB_STAGE_##constant,
    VKB_STAGES(VKB_STAGE_ENUM)
#undef VKB_STAGE_ENUM
        VKB_STAGE_COUNT,
};

struct vkb_stage {
    enum vkb_stage_kind kind;
    struct vkb_glare_values values;  // at the offsets of vkb_glare_rows
    float ghosts[MAX_GHOSTS][4];     // tint and scale of each
    uint32_t ghost_count;
};

// A pass of a method that was given at run time (methods/custom.c). The owner of the settings keeps
// the shader as long as there are rows of it.
struct vkb_custom_pass {
    struct vkb_custom_params params;
    uint64_t turn;
    uint32_t width, height;
    // Of a compute shader: pixels of a workgroup; 0: a fragment shader.
    uint32_t block_width, block_height;
    uint32_t framebuffer, read_count;
    char name[VKB_NAME_SIZE];  // of the image that it writes
    char reads[VKB_MAX_READS][VKB_NAME_SIZE];
    // Python packs what is before here, as "1024sQ6I32s512s".
    const struct vkb_shader *shader;
    const struct vkb_resource *resources[VKB_MAX_RESOURCES];
    uint32_t resource_count;
};

struct vkb_settings {
    enum vkb_method method;
    struct vkb_values values;  // the numbers, at the offsets of vkb_value_rows
    int choices[VKB_CHOICE_COUNT];
    int thresholded;                     // 0: threshold and knee have no effect
    uint32_t bloom_width, bloom_height;  // 0: by bloom_scale
    enum vkb_format format;              // VKB_FORMAT_NONE: by the source
    float weights[MAX_WEIGHTS];
    uint32_t weight_count;
    struct vkb_layer layers[MAX_LAYERS];
    uint32_t layer_count;
    float level_weights[MAX_LEVELS];
    uint32_t level_weight_count;          // 0: none are given
    float tint[3];                        // of the bloom, and the position of Blender's sun
    float sun_position[2];                // as shares of the sides from the lower left
    struct vkb_stage stages[MAX_STAGES];  // of glare
    uint32_t stage_count;
    // Python packs what is before here.
    struct vkb_kernel_data kernel;
    struct vkb_kernel_data dirt;           // the picture of the stage of dirt
    const struct vkb_custom_pass *passes;  // of VKB_METHOD_CUSTOM
    uint32_t pass_count;
};

// Whether the method convolves with a kernel that Python makes.
static inline bool vkb_needs_kernel(const struct vkb_settings *settings)
{
    const int type = settings->choices[VKB_CHOICE_type];

    return settings->values.bloom
        && (settings->method == VKB_METHOD_CONVOLUTION || settings->method == VKB_METHOD_UNREAL
            || settings->method == VKB_METHOD_HALATION
            || (settings->method == VKB_METHOD_BLENDER
                && (type == TYPE_FOG_GLOW || type == TYPE_KERNEL)));
}

static inline bool vkb_is_published(const struct vkb_settings *settings)
{
    switch (settings->method) {
#define VKB_METHOD_CASE(constant, name, published) \
    case VKB_METHOD_##constant: \
        return published;
        VKB_METHODS(VKB_METHOD_CASE)
#undef VKB_METHOD_CASE
    case VKB_METHOD_COUNT:
        break;
    }
    return false;
}

#endif
