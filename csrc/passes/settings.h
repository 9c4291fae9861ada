// The settings of a request in C: filled by arguments.c, read by the functions that make rows.
#ifndef VKB_SETTINGS_H
#define VKB_SETTINGS_H

#include "graph/graph.h"

// Every method: METHOD(name in C, name in Python and of its vkb_add_ function, the members of its
// row that are not zero). What sets a method apart from others outside of methods/ is such a
// member.
#define VKB_METHODS(METHOD) \
    METHOD(SEPARABLE, separable, .min_weights = 1, .min_layers = 1) \
    METHOD(PYRAMID, pyramid, .published = false) \
    METHOD(DUAL_KAWASE, dual_kawase, .published = false) \
    METHOD(CONVOLUTION, convolution, .kernel_types = VKB_ALL_TYPES) \
    METHOD(BEVY, bevy, .published = true) \
    METHOD(KINO, kino, .published = true) \
    METHOD(FILAMENT, filament, .published = true) \
    METHOD(URP, urp, .published = true) \
    METHOD(HDRP, hdrp, .published = true) \
    METHOD(THREE, three, .published = true) \
    METHOD(GODOT, godot, .published = true, .exposes_scene = true) \
    METHOD(BLENDER, blender, .published = true, .first = "frame", \
           .kernel_types = 1u << TYPE_FOG_GLOW | 1u << TYPE_KERNEL, \
           .composite_add = COMPOSITE_ADD_TO_POSITIVE) \
    METHOD(PYGFX, pygfx, .published = true) \
    METHOD(POST_PROCESSING, post_processing, .published = true) \
    METHOD(UNREAL, unreal, .published = true, .kernel_types = VKB_ALL_TYPES, \
           .sums_gaussians = true) \
    METHOD(HALATION, halation, .published = true, .kernel_types = VKB_ALL_TYPES) \
    METHOD(PMNDRS, pmndrs, .published = true, .composite_screen = COMPOSITE_UNCLAMPED_SCREEN) \
    METHOD(BABYLON, babylon, .published = true, .min_weights = 1) \
    METHOD(PLAYCANVAS, playcanvas, .published = true) \
    METHOD(DARKTABLE, darktable, .published = true, \
           .composite_screen = COMPOSITE_LIGHTNESS_SCREEN) \
    METHOD(CUSTOM, custom, .custom = true)

#define VKB_ALL_TYPES UINT32_MAX

struct vkb_method_row {
    // It starts from the complete frame: it reduces and thresholds in its own way.
    bool published;
    // Its passes are given at run time. They may read the scene, which is drawn before them.
    bool custom;
    // The exposure multiplies the scene before the composite, not the result.
    bool exposes_scene;
    // The name of the first image of the bloom, which then is no framebuffer; NULL: it is "glow".
    const char *first;
    // A bit for each type (VKB_CHOICE_type) that convolves with a kernel that Python makes.
    uint32_t kernel_types;
    // The kernel is the sum of the Gaussians of the settings. It is no framebuffer, since the bloom
    // has none where it is made of levels (methods/unreal.h).
    bool sums_gaussians;
    // The formulas of the composites "add" and "screen"; 0: those of their names.
    int composite_add, composite_screen;
    // The least number of weights and of layers that its settings have.
    uint32_t min_weights, min_layers;
    const char *name;
};

enum vkb_method {
#define VKB_METHOD_ENUM(constant, name, ...) VKB_METHOD_##constant,
    VKB_METHODS(VKB_METHOD_ENUM)
#undef VKB_METHOD_ENUM
        VKB_METHOD_COUNT,
};

extern const struct vkb_method_row vkb_method_rows[VKB_METHOD_COUNT];

struct vkb_layer {
    double scale, strength;
};

// The kernel of a convolution in pixels of the bloom buffers: four floats each, row by row, which
// the owner of the settings keeps.
struct vkb_kernel_data {
    const float *pixels;  // of four channels, or grey ones of one
    uint32_t width, height;
    uint64_t serial;  // equal only for equal pixels
    bool grey;
    float prefilter[3];  // min, max, factor; min above max: none
    // How far pixels that are not 0 lie from the centre at most.
    uint32_t reach_x, reach_y;
};

enum { VKB_MAX_FIELD = 512 };  // kernels

// A field of kernels (methods/field.c): how many the kernel's pixels have below each other, and
// their weights at the places of a grid. With `down` above 1 the kernels are a grid, whose columns
// are one after the other, and the weights are those of its columns, then those of its rows.
struct vkb_field {
    uint32_t count;          // 0: there is one kernel without weights
    uint32_t down;           // kernels in a column of a grid; 1: each has weights of its own
    int gathers;             // weights are multiplied after the convolution
    int first_unweighted;    // the first weight is 1
    uint32_t columns, rows;  // of the grid
    // Four weights a texel; for each column of the buffers, then for each row, the place in the
    // grid before it and the share of the next one, and for each place the first of those pixels
    // that it is before.
    struct vkb_kernel_data weights, places;
};

// How many weights a field has.
static inline uint32_t vkb_count_weights(const struct vkb_field *field)
{
    return field->count / field->down + (field->down > 1 ? field->down : 0);
}

// Every stage of glare: STAGE(name in C, name in Python, of its framebuffer and of its add_
// function in methods/glare.c). Dirt is a stage without a framebuffer: it changes the sum of the
// others.
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
    uint32_t groups_width, groups_height;  // numbers of workgroups; 0: what covers the target
    uint32_t framebuffer, read_count;
    uint32_t histories;  // bit i: it reads the history of reads[i], not what this frame has made
    uint32_t format;     // of the image that it writes; 0: that of the bloom buffers
    // Not a pass, but one more image that the pass before it writes: its next target.
    uint32_t joined;
    // Whether the fragment shader gets its position in the target, 0 to 1, as its first input.
    uint32_t positions;
    uint32_t vertices;         // of its own vertex shader; 0: of one triangle
    char name[VKB_NAME_SIZE];  // of the image that it writes
    char reads[VKB_MAX_READS][VKB_NAME_SIZE];
    uint8_t sampling[VKB_MAX_READS];  // of VKB_SAMPLING_*
    // Python packs what is before here, as "1024sQ13I32s512s16s4x".
    const struct vkb_shader *shader, *vertex;  // no vertex shader: that of the package
    const struct vkb_resource *resources[VKB_MAX_RESOURCES];
    uint32_t resource_count;
};

#define VKB_ADD_NUMBER(B, type, name) +1
enum { VKB_EXPOSURE_NUMBERS = 0 EXPOSURE_NUMBER_ROWS(, VKB_ADD_NUMBER) };

enum { VKB_TAA_NUMBERS = 0 TAA_NUMBER_ROWS(, VKB_ADD_NUMBER) };

#define VKB_ENGINE_ENUM(constant, value, ...) constant = value,
enum vkb_exposure_engine { EXPOSURES(VKB_ENGINE_ENUM) VKB_EXPOSURE_END };
enum vkb_taa_engine { TAAS(VKB_ENGINE_ENUM) VKB_TAA_END };
#undef VKB_ENGINE_ENUM

struct vkb_settings {
    enum vkb_method method;
    struct vkb_values values;  // the numbers, at the offsets of vkb_value_rows
    int choices[VKB_CHOICE_COUNT];
    int thresholded;  // 0: threshold and knee have no effect
    // Threshold and knee before a published method counts them in its own way, and their number: 2
    // or 0.
    float stage_threshold[2];
    uint32_t stage_threshold_count;
    uint32_t bloom_width, bloom_height;  // 0: by bloom_scale
    enum vkb_format format;              // VKB_FORMAT_NONE: by the source
    float weights[MAX_WEIGHTS];
    uint32_t weight_count;
    struct vkb_layer layers[MAX_LAYERS];
    uint32_t layer_count;
    float level_weights[MAX_LEVELS];
    uint32_t level_weight_count;           // 0: none are given
    float tint[3];                         // of the bloom, and the position of Blender's sun
    float sun_position[2];                 // as shares of the sides from the lower left
    double gaussian_sizes[MAX_GAUSSIANS];  // of Unreal's bloom, in percent of the frame's width
    double gaussian_tints[MAX_GAUSSIANS];
    struct vkb_stage stages[MAX_STAGES];  // of glare
    uint32_t stage_count;
    uint32_t exposure_engine;                      // of EXPOSURE_*; 0: there is no exposure
    float exposure_numbers[VKB_EXPOSURE_NUMBERS];  // in the order of EXPOSURE_NUMBER_ROWS
    float exposure_table[EXPOSURE_TABLE];
    uint32_t exposure_key_count;
    uint32_t taa_engine;                   // of TAA_*; 0: there is no temporal anti-aliasing
    uint32_t taa_after;                    // 1: the picture is resolved with its bloom
    float taa_numbers[VKB_TAA_NUMBERS];    // in the order of TAA_NUMBER_ROWS
    float taa_weights[3 * TAA_PHASES][4];  // of 3 x 3 pixels for each phase
    // Python packs what is before here.
    struct vkb_kernel_data kernel;  // of a field: the size is that of one
    struct vkb_field field;
    struct vkb_kernel_data dirt;           // the picture of the stage of dirt
    struct vkb_kernel_data exposure_mask;  // of the meter
    const struct vkb_custom_pass *passes;  // of a custom method
    uint32_t pass_count;
};

static inline const struct vkb_method_row *vkb_method_of(const struct vkb_settings *settings)
{
    return &vkb_method_rows[settings->method];
}

// Whether the method convolves with a kernel that Python makes.
static inline bool vkb_needs_kernel(const struct vkb_settings *settings)
{
    return settings->values.bloom
        && (vkb_method_of(settings)->kernel_types >> settings->choices[VKB_CHOICE_type] & 1);
}

#endif
