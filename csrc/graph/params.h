// shaders/params.h in C: a struct for each parameter block, tables of the settings, and the names
// that a choice can take.
#ifndef VKB_PARAMS_H
#define VKB_PARAMS_H

#include "shaders/params.h"

#include <stddef.h>
#include <stdint.h>

// The alignment of an array of vec4 in std140.
#define VKB_VEC4 _Alignas(16) float

#define VKB_MEMBER_READS(block, name)        float name;
#define VKB_MEMBER_INPUT(block, type, name)  type name;
#define VKB_MEMBER_VEC4S(block, name, count) VKB_VEC4 name[count][4];
#define VKB_BLOCK_STRUCT(block, ROWS) \
    struct vkb_##block##_params { \
        ROWS(block, VKB_MEMBER_READS, VKB_MEMBER_INPUT, VKB_MEMBER_VEC4S) \
    };
PARAMETER_BLOCKS(VKB_BLOCK_STRUCT)

#define VKB_BLOCK_MEMBER(block, ROWS) struct vkb_##block##_params block;

// The parameters of one pass, which are those of its block.
union vkb_params {
    PARAMETER_BLOCKS(VKB_BLOCK_MEMBER)
};

enum vkb_block {
    VKB_BLOCK_NONE,
#define VKB_BLOCK_ENUM(block, ROWS) VKB_BLOCK_##block,
    PARAMETER_BLOCKS(VKB_BLOCK_ENUM)
#undef VKB_BLOCK_ENUM
};

#define VKB_BLOCK_ONE(block, ROWS) +1
enum { VKB_BLOCK_COUNT = 1 PARAMETER_BLOCKS(VKB_BLOCK_ONE) };
#undef VKB_BLOCK_ONE

extern const size_t vkb_block_sizes[];  // bytes of each block's struct

// Defines a function that copies ROWS of params.h, made with VKB_COPY_*, from a block to another
// one that has them, too. It does not compile for blocks without them.
#define VKB_COPY_FUNCTION(function, target, source, ROWS) \
    static void function(struct vkb_##target##_params *to, \
                         const struct vkb_##source##_params *from) \
    { \
        ROWS \
    }
#define VKB_COPY_READS(block, name)        to->name = from->name;
#define VKB_COPY_INPUT(block, type, name)  to->name = from->name;
#define VKB_COPY_VEC4S(block, name, count) memcpy(to->name, from->name, sizeof to->name);

// Writes the fields of a block without the padding between them, whose content is undefined.
// `bytes` has space for vkb_block_sizes[block]. Returns the number of bytes.
size_t vkb_params_pack(enum vkb_block block, const union vkb_params *params, unsigned char *bytes);

// All settings that are numbers: those that passes read, and those that shape the graph.
struct vkb_values {
#define VKB_SETTING_MEMBER(name, initial, low, high) float name;
    SETTING_ROWS(VKB_SETTING_MEMBER)
#undef VKB_SETTING_MEMBER
#define VKB_COUNT_MEMBER(name, initial, low, high) int name;
    COUNT_ROWS(VKB_COUNT_MEMBER)
#undef VKB_COUNT_MEMBER
#define VKB_REAL_MEMBER(name, initial, low, high) double name;
    REAL_ROWS(VKB_REAL_MEMBER)
#undef VKB_REAL_MEMBER
};

// The numbers of a stage of glare.
struct vkb_glare_values {
#define VKB_SETTING_MEMBER(name, initial, low, high) float name;
    GLARE_SETTING_ROWS(VKB_SETTING_MEMBER)
#undef VKB_SETTING_MEMBER
#define VKB_COUNT_MEMBER(name, initial, low, high) int name;
    GLARE_COUNT_ROWS(VKB_COUNT_MEMBER)
#undef VKB_COUNT_MEMBER
};

enum vkb_value_type { VKB_VALUE_FLOAT, VKB_VALUE_INT, VKB_VALUE_DOUBLE };

// Copies the settings that a block reads.
void vkb_params_read(enum vkb_block block, const struct vkb_values *values,
                     union vkb_params *params);

// The offset of a setting in struct vkb_values, or of a number in struct vkb_glare_values, its
// default and its range.
struct vkb_value_row {
    const char *name;
    enum vkb_value_type type;
    size_t offset;
    double initial, low, high;
};

extern const struct vkb_value_row vkb_value_rows[];
extern const size_t vkb_value_row_count;
extern const struct vkb_value_row vkb_glare_rows[];
extern const size_t vkb_glare_row_count;

// A setting that is one of a list of names; the names' values count from 0.
struct vkb_choice_row {
    const char *name;
    const char *const *spellings;
    int count;
};

enum vkb_choice {
#define VKB_CHOICE_ENUM(choice, NAMES) VKB_CHOICE_##choice,
    CHOICES(VKB_CHOICE_ENUM)
#undef VKB_CHOICE_ENUM
        VKB_CHOICE_COUNT,
};

extern const struct vkb_choice_row vkb_choice_rows[VKB_CHOICE_COUNT];

// The specialization constants of a pass. All members are 32 bits wide: there is no padding.
struct vkb_constants {
#define VKB_CONSTANT_MEMBER(id, name, member) int32_t member;
    SPECIALIZATION_CONSTANTS(VKB_CONSTANT_MEMBER)
#undef VKB_CONSTANT_MEMBER
};

enum { VKB_CONSTANT_COUNT = sizeof(struct vkb_constants) / sizeof(int32_t) };

// For each constant, its id and its offset in the struct.
struct vkb_constant_row {
    uint32_t id;
    uint32_t offset;
};

extern const struct vkb_constant_row vkb_constant_rows[VKB_CONSTANT_COUNT];

#define VKB_NAME_ENUM(name, value, spelling) name = value,
enum vkb_composite { COMPOSITE_NAMES(VKB_NAME_ENUM) };
enum vkb_tonemap { TONEMAP_NAMES(VKB_NAME_ENUM) };
enum vkb_encoding { ENCODING_NAMES(VKB_NAME_ENUM) };
enum vkb_alpha { ALPHA_NAMES(VKB_NAME_ENUM) };
enum vkb_texel { TEXEL_NAMES(VKB_NAME_ENUM) };
enum vkb_boundary { BOUNDARY_NAMES(VKB_NAME_ENUM) };
enum vkb_type { TYPE_NAMES(VKB_NAME_ENUM) };
enum vkb_quality { QUALITY_NAMES(VKB_NAME_ENUM) };
enum vkb_blur_filter { FILTER_NAMES(VKB_NAME_ENUM) };
enum vkb_three_variant { VARIANT_NAMES(VKB_NAME_ENUM) };
enum vkb_mode { MODE_NAMES(VKB_NAME_ENUM) };
#define VKB_SET_ENUM(name, value, ROWS, KERNELS, PLACE, SHARE) name = value,
enum vkb_tap_set { TAP_SETS(VKB_SET_ENUM) LINE_SETS(VKB_NAME_ENUM) };
enum vkb_combine { COMBINATIONS(VKB_NAME_ENUM, VKB_NAME_ENUM, VKB_NAME_ENUM, VKB_NAME_ENUM) };
enum vkb_point { POINTS(VKB_NAME_ENUM) };
#undef VKB_NAME_ENUM

// The images that a pass reads (`reads` of its row).
enum vkb_slot {
#define VKB_SLOT_ENUM(name, number) name = number,
    SLOTS(VKB_SLOT_ENUM)
#undef VKB_SLOT_ENUM
};

#endif
