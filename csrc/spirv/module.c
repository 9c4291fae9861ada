#include "spirv/module.h"

// The words that a declaration has at least, and which of them is its id.
static const struct layout {
    uint32_t first, last;  // opcodes
    uint32_t words, id;
} layouts[] = {
    {SPV_TYPE_VOID, SPV_TYPE_BOOL, 2, 1},         {SPV_TYPE_INT, SPV_TYPE_FLOAT, 3, 1},
    {SPV_TYPE_VECTOR, SPV_TYPE_MATRIX, 4, 1},     {SPV_TYPE_ARRAY, SPV_TYPE_ARRAY, 4, 1},
    {SPV_TYPE_STRUCT, SPV_TYPE_STRUCT, 2, 1},     {SPV_TYPE_POINTER, SPV_TYPE_POINTER, 4, 1},
    {SPV_CONSTANT, SPV_CONSTANT, 4, 2},           {SPV_VARIABLE, SPV_VARIABLE, 4, 2},
    {SPV_SPEC_CONSTANT, SPV_SPEC_CONSTANT, 4, 2},
};

static bool declare(struct vkb_module *module, const uint32_t *at)
{
    for (size_t i = 0; i < sizeof layouts / sizeof layouts[0]; ++i) {
        const struct layout *layout = &layouts[i];
        if (vkb_opcode(at) < layout->first || vkb_opcode(at) > layout->last)
            continue;
        if (vkb_word_count(at) < layout->words || at[layout->id] >= module->bound)
            return false;
        module->at[at[layout->id]] = at;
    }
    return true;
}

static bool read_declarations(struct vkb_module *module, const uint32_t *end)
{
    const uint32_t *at = module->first;

    for (; at < end && vkb_opcode(at) != SPV_FUNCTION; at = vkb_next(at))
        if (vkb_word_count(at) == 0 || vkb_word_count(at) > (size_t)(end - at)
            || !declare(module, at))
            return false;
    module->functions = at;
    return at < end;
}

bool vkb_read_module(const struct vkb_shader *shader, struct vkb_module *module,
                     struct vkb_error *error)
{
    const size_t count = shader->size / sizeof *shader->code;
    const bool has_header = count > SPV_HEADER_WORDS && shader->code[0] == SPV_MAGIC
                         && shader->code[SPV_BOUND] <= SPV_MAX_BOUND;

    *module = (struct vkb_module){0};
    if (has_header) {
        module->first = shader->code + SPV_HEADER_WORDS;
        module->bound = shader->code[SPV_BOUND];
        module->at = vkb_alloc(error, (size_t)module->bound + 1, sizeof(*module->at));
        if (!module->at)
            return false;
    }
    return (has_header && read_declarations(module, shader->code + count))
        || vkb_fail(error, VKB_ERROR_SHADER, "%s is not SPIR-V", shader->name);
}

const uint32_t *vkb_declared(const struct vkb_module *module, uint32_t id)
{
    return id < module->bound ? module->at[id] : NULL;
}
