// Modules of SPIR-V: one that is read, and code that is written.
#ifndef VKB_MODULE_H
#define VKB_MODULE_H

#include "graph/shader.h"
#include "spirv/instructions.h"
#include "vulkan/error.h"

struct vkb_module {
    const uint32_t *first, *functions, *end;  // instructions; the first one of the first function
    uint32_t bound;                           // above all ids
    const uint32_t **at;                      // by id: what defines it; NULL: nothing
};

// Modules are what compilers make, and caches keep with a checksum: they are well-formed. An id may
// have no definition, as those of opcodes that vkb_result does not know. The caller frees
// `module->at` with vkb_free, also after a failure.
bool vkb_read_module(const struct vkb_shader *shader, struct vkb_module *module,
                     struct vkb_error *error);

// Whether a type is that of a bool or a 32-bit integer.
bool vkb_is_word(const struct vkb_module *module, uint32_t type);

// Whether an instruction declares a constant of such a type; `*value` is then its value or its
// default.
bool vkb_constant(const struct vkb_module *module, const uint32_t *at, uint32_t *value);

// Once writing has failed, nothing is written any more.
struct vkb_code {
    uint32_t *words;
    size_t count, capacity;
    bool failed;
    struct vkb_error *error;
};

void vkb_write(struct vkb_code *code, const uint32_t *words, size_t count);

// Writes an instruction with these operands.
#define VKB_WRITE(code, opcode, ...) \
    vkb_write( \
        code, \
        (const uint32_t[]){(uint32_t)(opcode) | (VKB_WORDS(0, __VA_ARGS__) << 16), __VA_ARGS__}, \
        VKB_WORDS(0, __VA_ARGS__))
#define VKB_WORDS(...) (uint32_t)(sizeof((const uint32_t[]){__VA_ARGS__}) / sizeof(uint32_t))

// Makes one instruction of the words from number `first` on, whose first one is its opcode.
void vkb_end_instruction(struct vkb_code *code, size_t first);

// Writes a constant whose type is that of a bool or a 32-bit integer.
void vkb_write_constant(struct vkb_code *code, const struct vkb_module *module, uint32_t type,
                        uint32_t id, uint32_t value);

#endif
