#include "graph/module.h"

#include <string.h>

static bool read_definitions(struct vkb_module *module)
{
    for (const uint32_t *at = module->first; at < module->end; at = vkb_next(at)) {
        if (vkb_word_count(at) == 0 || vkb_word_count(at) > (size_t)(module->end - at)
            || vkb_result(at) >= module->bound)
            return false;
        if (vkb_result(at))
            module->at[vkb_result(at)] = at;
        if (vkb_opcode(at) == SPV_FUNCTION && !module->functions)
            module->functions = at;
    }
    return module->functions != NULL;
}

bool vkb_read_module(const struct vkb_shader *shader, struct vkb_module *module,
                     struct vkb_error *error)
{
    const size_t count = shader->size / sizeof *shader->code;
    const bool has_header = count > SPV_HEADER_WORDS && shader->code[0] == SPV_MAGIC;

    *module = (struct vkb_module){0};
    if (has_header) {
        module->first = shader->code + SPV_HEADER_WORDS;
        module->end = shader->code + count;
        module->bound = shader->code[SPV_BOUND];
        module->at = vkb_alloc(error, (size_t)module->bound + 1, sizeof(*module->at));
        if (!module->at)
            return false;
    }
    return (has_header && read_definitions(module))
        || vkb_fail(error, VKB_ERROR_SHADER, "%s is not SPIR-V", shader->name);
}

bool vkb_is_word(const struct vkb_module *module, uint32_t type)
{
    const uint32_t *at = type < module->bound ? module->at[type] : NULL;

    return at
        && (vkb_opcode(at) == SPV_TYPE_BOOL || (vkb_opcode(at) == SPV_TYPE_INT && at[2] == 32));
}

bool vkb_constant(const struct vkb_module *module, const uint32_t *at, uint32_t *value)
{
    const uint32_t code = vkb_opcode(at);

    if (code == SPV_CONSTANT || code == SPV_SPEC_CONSTANT) {
        *value = at[3];
        return vkb_is_word(module, at[1]);
    }
    *value = code == SPV_CONSTANT_TRUE || code == SPV_SPEC_CONSTANT_TRUE;
    return *value || code == SPV_CONSTANT_FALSE || code == SPV_SPEC_CONSTANT_FALSE;
}

void vkb_write(struct vkb_code *code, const uint32_t *words, size_t count)
{
    code->failed = code->failed
                || !vkb_grow(code->error, &code->words, &code->capacity, code->count + count,
                             sizeof *words);
    if (code->failed)
        return;
    memcpy(code->words + code->count, words, count * sizeof *words);
    code->count += count;
}

void vkb_end_instruction(struct vkb_code *code, size_t first)
{
    if (!code->failed)
        code->words[first] =
            vkb_opcode(&code->words[first]) | (uint32_t)(code->count - first) << 16;
}

void vkb_write_constant(struct vkb_code *code, const struct vkb_module *module, uint32_t type,
                        uint32_t id, uint32_t value)
{
    if (vkb_opcode(module->at[type]) != SPV_TYPE_BOOL)
        VKB_WRITE(code, SPV_CONSTANT, type, id, value);
    else
        VKB_WRITE(code, value ? SPV_CONSTANT_TRUE : SPV_CONSTANT_FALSE, type, id);
}
