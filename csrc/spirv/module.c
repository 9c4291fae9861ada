#include "spirv/module.h"

#include <string.h>

// The words that an instruction has at least, and which of them are ids and ids of labels. What has
// no row here is read only where it has a result: a type and an id.
struct layout {
    uint32_t first, last;  // opcodes
    uint32_t words, ids, labels;
};

#define W(i) (1u << (i))

static const struct layout layouts[] = {
    {SPV_EXT_INST, SPV_EXT_INST, 5, W(3), 0},
    {SPV_ENTRY_POINT, SPV_ENTRY_POINT, 4, W(2), 0},
    {SPV_TYPE_VOID, SPV_TYPE_BOOL, 2, 0, 0},
    {SPV_TYPE_INT, SPV_TYPE_INT, 4, 0, 0},
    {SPV_TYPE_FLOAT, SPV_TYPE_FLOAT, 3, 0, 0},
    {SPV_TYPE_VECTOR, SPV_TYPE_MATRIX, 4, W(2), 0},
    {SPV_TYPE_ARRAY, SPV_TYPE_ARRAY, 4, W(2) | W(3), 0},
    {SPV_TYPE_POINTER, SPV_TYPE_POINTER, 4, W(3), 0},
    {SPV_TYPE_VOID, SPV_TYPE_FORWARD_POINTER, 2, 0, 0},
    {SPV_CONSTANT, SPV_CONSTANT, 4, 0, 0},
    {SPV_SPEC_CONSTANT, SPV_SPEC_CONSTANT, 4, 0, 0},
    {SPV_SPEC_CONSTANT_OP, SPV_SPEC_CONSTANT_OP, 4, 0, 0},
    {SPV_FUNCTION, SPV_FUNCTION, 5, 0, 0},
    {SPV_FUNCTION_CALL, SPV_FUNCTION_CALL, 4, W(3), 0},
    {SPV_DECORATE, SPV_DECORATE, 3, W(1), 0},
    {SPV_PHI, SPV_PHI, 5, W(3), W(4)},
    {SPV_LOOP_MERGE, SPV_LOOP_MERGE, 4, 0, W(1) | W(2)},
    {SPV_SELECTION_MERGE, SPV_SELECTION_MERGE, 3, 0, W(1)},
    {SPV_LABEL, SPV_LABEL, 2, W(1), 0},
    {SPV_BRANCH, SPV_BRANCH, 2, 0, W(1)},
    {SPV_BRANCH_CONDITIONAL, SPV_BRANCH_CONDITIONAL, 4, W(1), W(2) | W(3)},
    {SPV_SWITCH, SPV_SWITCH, 3, W(1), W(2)},
};

static const struct layout *layout_of(uint32_t opcode)
{
    for (size_t i = 0; i < sizeof layouts / sizeof layouts[0]; ++i)
        if (opcode >= layouts[i].first && opcode <= layouts[i].last)
            return &layouts[i];
    return NULL;
}

// Whether an instruction has the words that vkb_result reads, and those of its layout.
static bool has_words(const uint32_t *at)
{
    const uint32_t count = vkb_word_count(at), code = vkb_opcode(at);
    const struct layout *layout = layout_of(code);

    if (layout && count < layout->words)
        return false;
    if (code == SPV_DECORATE && at[2] == SPV_SPEC_ID)
        return count >= 4;
    // An operation without operands that has no row is still one with a type and a result.
    return count >= 3 || (layout && layout->words < 3) || !vkb_has_result(code);
}

static bool is_label(const struct vkb_module *module, uint32_t id)
{
    return id < module->bound && module->at[id] && vkb_opcode(module->at[id]) == SPV_LABEL;
}

// Whether ids are below the bound, and those of blocks name blocks.
static bool has_ids(const struct vkb_module *module, const uint32_t *at)
{
    const struct layout *layout = layout_of(vkb_opcode(at));
    const uint32_t count = vkb_word_count(at), code = vkb_opcode(at);

    for (uint32_t i = 1; layout && i < layout->words; ++i)
        if (((layout->ids & W(i)) && at[i] >= module->bound)
            || ((layout->labels & W(i)) && !is_label(module, at[i])))
            return false;
    // Pairs follow: of a value and the block before, or of a number and a block.
    if (code == SPV_PHI || code == SPV_SWITCH)
        for (uint32_t i = 3; i < count; i += 2)
            if (i + 1 >= count || !is_label(module, at[i + 1])
                || (code == SPV_PHI && at[i] >= module->bound))
                return false;
    return !vkb_has_result(code) || code == SPV_LABEL
        || (code >= SPV_TYPE_VOID && code < SPV_TYPE_FORWARD_POINTER) || at[1] < module->bound;
}

// Whether functions are made of blocks: each begins with a label and has one end, which follows a
// declaration of its structure.
static bool has_blocks(const struct vkb_module *module)
{
    enum { OUTSIDE, IN_FUNCTION, IN_BLOCK, AT_THE_END } state = OUTSIDE;

    for (const uint32_t *at = module->first; at < module->end; at = vkb_next(at)) {
        const uint32_t code = vkb_opcode(at);
        const bool ends = vkb_ends_block(at),
                   merges = code == SPV_LOOP_MERGE || code == SPV_SELECTION_MERGE;
        if (state == AT_THE_END && !ends)
            return false;
        if (code == SPV_FUNCTION ? state != OUTSIDE
            : code == SPV_FUNCTION_END || code == SPV_LABEL
                ? state != IN_FUNCTION || (code == SPV_LABEL && at[1] == 0)
                : (ends || merges) && state < IN_BLOCK)
            return false;
        state = code == SPV_FUNCTION || ends ? IN_FUNCTION
              : code == SPV_FUNCTION_END     ? OUTSIDE
              : code == SPV_LABEL            ? IN_BLOCK
              : merges                       ? AT_THE_END
                                             : state;
    }
    return state == OUTSIDE;
}

static bool read_definitions(struct vkb_module *module)
{
    for (const uint32_t *at = module->first; at < module->end; at = vkb_next(at)) {
        if (vkb_word_count(at) == 0 || vkb_word_count(at) > (size_t)(module->end - at)
            || !has_words(at) || vkb_result(at) >= module->bound)
            return false;
        if (vkb_result(at) && module->at[vkb_result(at)])
            return false;
        if (vkb_result(at))
            module->at[vkb_result(at)] = at;
        if (vkb_opcode(at) == SPV_FUNCTION && !module->functions)
            module->functions = at;
    }
    for (const uint32_t *at = module->first; at < module->end; at = vkb_next(at))
        if (!has_ids(module, at))
            return false;
    return module->functions && has_blocks(module);
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
