// Declarations of a module of SPIR-V: a header of five words, then instructions, whose first word
// is their number of words and their opcode.
#ifndef VKB_MODULE_H
#define VKB_MODULE_H

#include "graph/shader.h"
#include "vulkan/error.h"

enum vkb_spirv {
    SPV_MAGIC = 0x07230203,
    SPV_BOUND = 3,  // the word of the header that all ids are below
    SPV_HEADER_WORDS = 5,
    SPV_MAX_BOUND = 0x3fffff,
    SPV_LOCAL_SIZE = 17,  // an execution mode
    SPV_WORKGROUP = 4,    // a storage class
};

enum vkb_opcode {
    SPV_EXECUTION_MODE = 16,
    SPV_TYPE_VOID = 19,
    SPV_TYPE_BOOL,
    SPV_TYPE_INT,
    SPV_TYPE_FLOAT,
    SPV_TYPE_VECTOR,
    SPV_TYPE_MATRIX,
    SPV_TYPE_ARRAY = 28,
    SPV_TYPE_STRUCT = 30,
    SPV_TYPE_POINTER = 32,
    SPV_CONSTANT = 43,
    SPV_SPEC_CONSTANT = 50,
    SPV_FUNCTION = 54,
    SPV_VARIABLE = 59,
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

struct vkb_module {
    const uint32_t *first, *functions;  // declarations; the first instruction after them
    uint32_t bound;                     // above all ids
    const uint32_t **at;                // by id: the type, constant or variable; NULL: none
};

// Fails if the shader is not SPIR-V whose declarations lie within it. Types, constants and
// variables have the words that their opcodes need. Either way the caller frees `module->at` with
// vkb_free.
bool vkb_read_module(const struct vkb_shader *shader, struct vkb_module *module,
                     struct vkb_error *error);

// What declares the id; NULL: nothing.
const uint32_t *vkb_declared(const struct vkb_module *module, uint32_t id);

#endif
