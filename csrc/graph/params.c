#include "graph/params.h"

#include <string.h>

#define SKIP_INPUT(block, type, name)
#define SKIP_VEC4S(block, name, count)
#define SETTING_ROW(name, initial, low, high) \
    {#name, VKB_VALUE_FLOAT, offsetof(struct vkb_values, name), initial, low, high},
#define COUNT_ROW(name, initial, low, high) \
    {#name, VKB_VALUE_INT, offsetof(struct vkb_values, name), initial, low, high},
#define GLARE_SETTING_ROW(name, initial, low, high) \
    {#name, VKB_VALUE_FLOAT, offsetof(struct vkb_glare_values, name), initial, low, high},
#define GLARE_COUNT_ROW(name, initial, low, high) \
    {#name, VKB_VALUE_INT, offsetof(struct vkb_glare_values, name), initial, low, high},
#define REAL_ROW(name, initial, low, high) \
    {#name, VKB_VALUE_DOUBLE, offsetof(struct vkb_values, name), initial, low, high},

const struct vkb_value_row vkb_value_rows[] = {SETTING_ROWS(SETTING_ROW) COUNT_ROWS(COUNT_ROW)
                                                   REAL_ROWS(REAL_ROW)};
const size_t vkb_value_row_count = sizeof vkb_value_rows / sizeof vkb_value_rows[0];

const struct vkb_value_row vkb_glare_rows[] = {GLARE_SETTING_ROWS(GLARE_SETTING_ROW)
                                                   GLARE_COUNT_ROWS(GLARE_COUNT_ROW)};
const size_t vkb_glare_row_count = sizeof vkb_glare_rows / sizeof vkb_glare_rows[0];

#define SPELLING(name, value, spelling) [value] = #spelling,
#define SPELLINGS(choice, NAMES) static const char *const choice##_spellings[] = {NAMES(SPELLING)};
CHOICES(SPELLINGS)

#define CHOICE_ROW(choice, NAMES) \
    [VKB_CHOICE_##choice] = {#choice, choice##_spellings, \
                             sizeof choice##_spellings / sizeof choice##_spellings[0]},

const struct vkb_choice_row vkb_choice_rows[VKB_CHOICE_COUNT] = {CHOICES(CHOICE_ROW)};

#define BLOCK_SIZE(block, ROWS) [VKB_BLOCK_##block] = sizeof(struct vkb_##block##_params),

const size_t vkb_block_sizes[] = {[VKB_BLOCK_NONE] = 0, PARAMETER_BLOCKS(BLOCK_SIZE)};

#define PACK(block, name) \
    memcpy(bytes + size, &params->block.name, sizeof params->block.name); \
    size += sizeof params->block.name;
#define PACK_READS(block, name)        PACK(block, name)
#define PACK_INPUT(block, type, name)  PACK(block, name)
#define PACK_VEC4S(block, name, count) PACK(block, name)
#define PACK_BLOCK(block, ROWS) \
    case VKB_BLOCK_##block: \
        ROWS(block, PACK_READS, PACK_INPUT, PACK_VEC4S) \
        break;

size_t vkb_params_pack(enum vkb_block block, const union vkb_params *params, unsigned char *bytes)
{
    size_t size = 0;

    switch (block) {
    case VKB_BLOCK_NONE:
        break;
        PARAMETER_BLOCKS(PACK_BLOCK)
    }
    return size;
}

#define READ(block, name) params->block.name = values->name;
#define READ_BLOCK(block, ROWS) \
    case VKB_BLOCK_##block: \
        ROWS(block, READ, SKIP_INPUT, SKIP_VEC4S) \
        break;

void vkb_params_read(enum vkb_block block, const struct vkb_values *values,
                     union vkb_params *params)
{
    switch (block) {
    case VKB_BLOCK_NONE:
        break;
        PARAMETER_BLOCKS(READ_BLOCK)
    }
}

#define CONSTANT_ROW(id, name, member) {id, offsetof(struct vkb_constants, member)},

const struct vkb_constant_row vkb_constant_rows[VKB_CONSTANT_COUNT] = {
    SPECIALIZATION_CONSTANTS(CONSTANT_ROW)};
