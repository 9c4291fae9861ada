// Instructions of SPIR-V 1.3. A module is a header of five words, then instructions, whose first
// word is their number of words and their opcode.
#ifndef VKB_INSTRUCTIONS_H
#define VKB_INSTRUCTIONS_H

#include <stdbool.h>
#include <stdint.h>

enum {
    SPV_MAGIC = 0x07230203,  // the first word of the header
    SPV_HEADER_WORDS = 5,
    SPV_BOUND = 3,    // the word of the header that all ids are below
    SPV_SPEC_ID = 1,  // a decoration
};

enum vkb_opcode {
    SPV_SOURCE_CONTINUED = 2,
    SPV_LINE = 8,
    SPV_EXT_INST = 12,
    SPV_ENTRY_POINT = 15,
    SPV_TYPE_VOID = 19,
    SPV_TYPE_BOOL,
    SPV_TYPE_INT,
    SPV_TYPE_FORWARD_POINTER = 39,
    SPV_CONSTANT_TRUE = 41,
    SPV_CONSTANT_FALSE,
    SPV_CONSTANT,
    SPV_SPEC_CONSTANT_TRUE = 48,
    SPV_SPEC_CONSTANT_FALSE,
    SPV_SPEC_CONSTANT,
    SPV_SPEC_CONSTANT_OP = 52,
    SPV_FUNCTION = 54,
    SPV_FUNCTION_END = 56,
    SPV_FUNCTION_CALL,
    SPV_VARIABLE = 59,
    SPV_LOAD = 61,
    SPV_ACCESS_CHAIN = 65,
    SPV_IN_BOUNDS_ACCESS_CHAIN,
    SPV_DECORATE = 71,
    SPV_VECTOR_EXTRACT_DYNAMIC = 77,
    SPV_IMAGE_READ = 98,
    SPV_IMAGE = 100,
    SPV_IMAGE_QUERY_SAMPLES = 107,
    SPV_CONVERT_F_TO_U = 109,
    SPV_BITCAST = 124,
    SPV_S_NEGATE = 126,
    SPV_I_ADD = 128,
    SPV_I_SUB = 130,
    SPV_I_MUL = 132,
    SPV_U_DIV = 134,
    SPV_S_DIV,
    SPV_U_MOD = 137,
    SPV_S_REM,
    SPV_S_MOD,
    SPV_LOGICAL_EQUAL = 164,
    SPV_LOGICAL_NOT_EQUAL,
    SPV_LOGICAL_OR,
    SPV_LOGICAL_AND,
    SPV_LOGICAL_NOT,
    SPV_SELECT,
    SPV_I_EQUAL,
    SPV_I_NOT_EQUAL,
    SPV_U_GREATER,
    SPV_S_GREATER,
    SPV_U_GREATER_EQUAL,
    SPV_S_GREATER_EQUAL,
    SPV_U_LESS,
    SPV_S_LESS,
    SPV_U_LESS_EQUAL,
    SPV_S_LESS_EQUAL,
    SPV_SHIFT_RIGHT_LOGICAL = 194,
    SPV_SHIFT_RIGHT_ARITHMETIC,
    SPV_SHIFT_LEFT_LOGICAL,
    SPV_BITWISE_OR,
    SPV_BITWISE_XOR,
    SPV_BITWISE_AND,
    SPV_NOT,
    SPV_FWIDTH_COARSE = 215,
    SPV_ATOMIC_LOAD = 227,
    SPV_ATOMIC_STORE,
    SPV_ATOMIC_XOR = 242,
    SPV_PHI = 245,
    SPV_LOOP_MERGE,
    SPV_SELECTION_MERGE,
    SPV_LABEL,
    SPV_BRANCH,
    SPV_BRANCH_CONDITIONAL,
    SPV_SWITCH,
    SPV_UNREACHABLE = 255,
    SPV_NO_LINE = 317,
    SPV_MODULE_PROCESSED = 330,
    SPV_TERMINATE_INVOCATION = 4416,
};

static inline uint32_t vkb_opcode(const uint32_t *at)
{
    return at[0] & 0xffff;
}

static inline uint32_t vkb_word_count(const uint32_t *at)
{
    return at[0] >> 16;
}

static inline const uint32_t *vkb_next(const uint32_t *at)
{
    return at + vkb_word_count(at);
}

// Whether it only helps to debug.
bool vkb_is_debug(const uint32_t *at);

// Whether it is the last one of a block.
bool vkb_ends_block(const uint32_t *at);

// Number i of the blocks that may follow this end of a block; 0: there are no more.
uint32_t vkb_target(const uint32_t *at, uint32_t i);

// The id that a type, a constant, a label or an instruction of a function defines; 0: none.
uint32_t vkb_result(const uint32_t *at);

// Computes an operation on one or two bools or 32-bit integers. Fails if it is another one, or if
// the result is not defined.
bool vkb_arithmetic(uint32_t opcode, uint32_t x, uint32_t y, uint32_t *value);

#endif
