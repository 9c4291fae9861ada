#include "spirv/module.h"

#include <string.h>

bool vkb_read_module(const struct vkb_shader *shader, struct vkb_module *module,
                     struct vkb_error *error)
{
    *module = (struct vkb_module){
        .first = shader->code + SPV_HEADER_WORDS,
        .end = shader->code + shader->size / sizeof *shader->code,
        .bound = shader->code[SPV_BOUND],
    };
    module->at = vkb_alloc(error, (size_t)module->bound + 1, sizeof(*module->at));
    if (!module->at)
        return false;
    for (const uint32_t *at = module->first; at < module->end; at = vkb_next(at)) {
        const uint32_t id = vkb_result(at);
        if (id >= module->bound) {
            vkb_free(module->at);
            module->at = NULL;
            return vkb_fail(error, VKB_ERROR_SHADER,
                            "%s: the SPIR-V has an id that is not below "
                            "its bound",
                            shader->name);
        }
        if (id)
            module->at[id] = at;
        if (vkb_opcode(at) == SPV_FUNCTION && !module->functions)
            module->functions = at;
    }
    return true;
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
    return (*value || code == SPV_CONSTANT_FALSE || code == SPV_SPEC_CONSTANT_FALSE)
        && vkb_is_word(module, at[1]);
}

void vkb_write(struct vkb_code *code, const uint32_t *words, size_t count)
{
    code->failed = code->failed
                || !vkb_grow(code->error, &code->words, &code->capacity, code->count + count,
                             sizeof *words);
    if (code->failed || count == 0)
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
