#include "spirv/specialize.h"

#include "spirv/module.h"

#include <string.h>

// A block that nothing reaches has to stay where a header names it.
enum role { NO_ROLE, MERGE_BLOCK, CONTINUE_BLOCK };

struct id {
    const uint32_t *end;  // of a label: the instruction that ends the block
    uint32_t value;       // if `known`
    uint32_t block;       // the label of its block; of a function, that of its first block
    uint32_t loop;        // between a loop's header and a continue block that nothing reaches
    bool known;           // a 32-bit integer or a bool whose value is known
    bool reached;         // of a label
    uint8_t role;         // of a label, enum role
};

struct module {
    struct vkb_module read;
    uint32_t entry;  // of the entry point
    struct id *ids;
    uint32_t *stack;  // of ids
    size_t stack_count;
    struct vkb_code made;
};

// Notes where each block starts and ends, and in which one each id is defined.
static void read_blocks(struct module *module)
{
    uint32_t block = 0, function = 0;

    for (const uint32_t *at = module->read.functions; at < module->read.end; at = vkb_next(at)) {
        if (vkb_opcode(at) == SPV_FUNCTION)
            function = at[2];
        else if (vkb_opcode(at) == SPV_LABEL) {
            block = at[1];
            if (!module->ids[function].block)
                module->ids[function].block = block;
        }
        if (vkb_result(at) && vkb_opcode(at) != SPV_FUNCTION)
            module->ids[vkb_result(at)].block = block;
        if (vkb_ends_block(at)) {
            module->ids[block].end = at;
            block = 0;
        }
    }
}

// The value of an operation on ids, if it follows from what is known.
static bool evaluate(const struct module *module, uint32_t code, const uint32_t *operands,
                     size_t count, uint32_t *value)
{
    const bool either = code == SPV_LOGICAL_AND || code == SPV_LOGICAL_OR;
    const size_t needed = code == SPV_SELECT ? 3 : either ? 2 : 1;
    const struct id *of[3] = {0};

    if (count < needed || count > 3)
        return false;
    for (size_t i = 0; i < count; ++i) {
        if (operands[i] >= module->read.bound)
            return false;
        of[i] = &module->ids[operands[i]];
    }
    // One operand decides.
    for (size_t i = 0; i < 2 && either; ++i)
        if (of[i]->known && of[i]->value == (code == SPV_LOGICAL_OR)) {
            *value = code == SPV_LOGICAL_OR;
            return true;
        }
    if (!of[0]->known)
        return false;
    if (code == SPV_SELECT) {
        const struct id *chosen = of[0]->value ? of[1] : of[2];
        *value = chosen->value;
        return chosen->known;
    }
    if (count == 2 && !of[1]->known)
        return false;
    return count < 3 && vkb_arithmetic(code, of[0]->value, count == 2 ? of[1]->value : 0, value);
}

// The block that a branch of two targets always goes to; 0: not known. The branch that closes a
// loop stays, since a loop has one.
static uint32_t only_target(const struct module *module, const uint32_t *at)
{
    const uint32_t *const *defined = module->read.at;

    if (vkb_opcode(at) != SPV_BRANCH_CONDITIONAL || !module->ids[at[1]].known
        || defined[at[2]] <= at || defined[at[3]] <= at)
        return 0;
    return module->ids[at[1]].value ? at[2] : at[3];
}

// Number i of the blocks that may follow this end of a block; 0: there are no more.
static uint32_t target(const struct module *module, const uint32_t *at, uint32_t i)
{
    const uint32_t only = only_target(module, at);

    if (only)
        return i == 0 ? only : 0;
    return vkb_target(at, i);
}

static bool follows(const struct module *module, uint32_t from, uint32_t label)
{
    const struct id *block = &module->ids[from];

    for (uint32_t i = 0; block->reached && target(module, block->end, i); ++i)
        if (target(module, block->end, i) == label)
            return true;
    return false;
}

static void reach(struct module *module, uint32_t label)
{
    if (label == 0 || module->ids[label].reached)
        return;
    module->ids[label].reached = true;
    module->stack[module->stack_count++] = label;
}

// Finds the blocks that the entry point reaches, also through calls.
static void find_reached(struct module *module)
{
    for (uint32_t i = 0; i < module->read.bound; ++i)
        module->ids[i].reached = false;
    reach(module, module->ids[module->entry].block);
    while (module->stack_count > 0) {
        const uint32_t label = module->stack[--module->stack_count];
        const uint32_t *at = module->read.at[label], *end = module->ids[label].end;
        for (; at < end; at = vkb_next(at))
            if (vkb_opcode(at) == SPV_FUNCTION_CALL)
                reach(module, module->ids[at[3]].block);
        for (uint32_t i = 0; target(module, end, i); ++i)
            reach(module, target(module, end, i));
    }
}

static bool phi_value(const struct module *module, const uint32_t *at, uint32_t *value)
{
    const struct id *first = NULL;

    for (uint32_t i = 3; i + 1 < vkb_word_count(at); i += 2) {
        const struct id *operand = &module->ids[at[i]];
        if (at[i] == at[2] || !follows(module, at[i + 1], module->ids[at[2]].block))
            continue;
        if (!operand->known || (first && operand->value != first->value))
            return false;
        first = operand;
    }
    if (first)
        *value = first->value;
    return first != NULL;
}

// Finds values in the blocks that are reached. Returns whether there were new ones.
static bool find_values(struct module *module)
{
    bool more = false;

    for (const uint32_t *at = module->read.functions; at < module->read.end; at = vkb_next(at)) {
        struct id *id = &module->ids[vkb_result(at)];
        if (!vkb_result(at) || id->known || !module->ids[id->block].reached
            || !vkb_is_word(&module->read, at[1]))
            continue;
        id->known = vkb_opcode(at) == SPV_PHI ? phi_value(module, at, &id->value)
                                              : evaluate(module, vkb_opcode(at), at + 3,
                                                         vkb_word_count(at) - 3, &id->value);
        more |= id->known;
    }
    return more;
}

// The value that a constant is given; what has no row keeps its default.
static void give_value(struct module *module, const uint32_t *decoration,
                       const struct vkb_constants *constants)
{
    const uint32_t *at = module->read.at[decoration[1]];
    struct id *id = &module->ids[decoration[1]];

    for (uint32_t i = 0; at && i < VKB_CONSTANT_COUNT; ++i)
        if (vkb_constant_rows[i].id == decoration[3]) {
            memcpy(&id->value, (const char *)constants + vkb_constant_rows[i].offset,
                   sizeof id->value);
            if (vkb_opcode(at) != SPV_SPEC_CONSTANT)
                id->value = id->value != 0;
            id->known = vkb_is_word(&module->read, at[1]);
        }
}

static void find_constants(struct module *module, const struct vkb_constants *constants)
{
    const struct vkb_module *read = &module->read;

    for (const uint32_t *at = read->first; at < read->functions; at = vkb_next(at)) {
        const uint32_t code = vkb_opcode(at);
        struct id *id = &module->ids[vkb_result(at)];
        if (code == SPV_ENTRY_POINT)
            module->entry = at[2];
        else if (code == SPV_DECORATE && at[2] == SPV_SPEC_ID)
            give_value(module, at, constants);
        else if (code == SPV_SPEC_CONSTANT_OP && vkb_is_word(read, at[1]))
            id->known = evaluate(module, at[3], at + 4, vkb_word_count(at) - 4, &id->value);
        else if (!id->known)
            id->known = vkb_constant(read, at, &id->value);
    }
}

// Notes which blocks a header names that nothing reaches.
static void keep_structure(struct module *module, const uint32_t *at, uint32_t header)
{
    struct id *ids = module->ids;

    if (!ids[at[1]].reached)
        ids[at[1]].role = MERGE_BLOCK;
    if (vkb_opcode(at) == SPV_LOOP_MERGE && !ids[at[2]].reached) {
        ids[at[2]].role = CONTINUE_BLOCK;
        ids[at[2]].loop = header;
        ids[header].loop = at[2];
    }
}

// A selection whose branch always goes one way is none.
static bool stays(const struct module *module, const uint32_t *at)
{
    return vkb_opcode(at) != SPV_SELECTION_MERGE || !only_target(module, vkb_next(at));
}

// Notes the blocks that nothing reaches and that the headers of those that are reached name.
static void find_structure(struct module *module)
{
    uint32_t block = 0;

    for (const uint32_t *at = module->read.functions; at < module->read.end; at = vkb_next(at)) {
        if (vkb_opcode(at) == SPV_LABEL)
            block = at[1];
        if (module->ids[block].reached && stays(module, at)
            && (vkb_opcode(at) == SPV_SELECTION_MERGE || vkb_opcode(at) == SPV_LOOP_MERGE))
            keep_structure(module, at, block);
    }
}

static void write_declarations(struct module *module)
{
    const struct vkb_module *read = &module->read;

    for (const uint32_t *at = read->first; at < read->functions; at = vkb_next(at)) {
        const uint32_t code = vkb_opcode(at);
        const uint32_t id = code == SPV_DECORATE ? at[1] : vkb_result(at);
        if (vkb_is_debug(at)
            || (code == SPV_DECORATE
                && (at[2] == SPV_SPEC_ID
                    || (module->ids[id].block && !module->ids[module->ids[id].block].reached))))
            continue;
        if (module->ids[id].known && code >= SPV_SPEC_CONSTANT_TRUE && code <= SPV_SPEC_CONSTANT_OP)
            vkb_write_constant(&module->made, read, at[1], id, module->ids[id].value);
        else
            vkb_write(&module->made, at, vkb_word_count(at));
    }
}

// A block that only the structure needs.
static void write_unreached(struct module *module, const uint32_t *label)
{
    const struct id *id = &module->ids[label[1]];

    if (id->role == NO_ROLE)
        return;
    vkb_write(&module->made, label, vkb_word_count(label));
    if (id->role == CONTINUE_BLOCK)
        VKB_WRITE(&module->made, SPV_BRANCH, id->loop);
    else
        vkb_write(&module->made, &(uint32_t){1 << 16 | SPV_UNREACHABLE}, 1);
}

// Only the entries of blocks that this one follows stay. A continue block that nothing reaches
// gives the phi itself: any value would do.
static void write_phi(struct module *module, const uint32_t *at)
{
    const uint32_t block = module->ids[at[2]].block;
    const size_t first = module->made.count;

    vkb_write(&module->made, at, 3);
    for (uint32_t i = 3; i < vkb_word_count(at); i += 2)
        if (follows(module, at[i + 1], block))
            vkb_write(&module->made, at + i, 2);
    if (module->ids[block].loop)
        vkb_write(&module->made, (uint32_t[]){at[2], module->ids[block].loop}, 2);
    vkb_end_instruction(&module->made, first);
}

static void write_functions(struct module *module)
{
    bool reached = false, function_reached = false;

    for (const uint32_t *at = module->read.functions; at < module->read.end; at = vkb_next(at)) {
        const uint32_t code = vkb_opcode(at), only = only_target(module, at);
        const struct id *id = &module->ids[vkb_result(at)];
        if (code == SPV_FUNCTION)
            reached = function_reached = module->ids[id->block].reached;
        else if (code == SPV_FUNCTION_END)
            reached = function_reached;
        else if (code == SPV_LABEL) {
            reached = id->reached;
            if (!reached)
                write_unreached(module, at);
        }
        if (!reached || vkb_is_debug(at) || !stays(module, at))
            continue;
        if (only)
            VKB_WRITE(&module->made, SPV_BRANCH, only);
        else if (code == SPV_PHI)
            write_phi(module, at);
        else
            vkb_write(&module->made, at, vkb_word_count(at));
    }
}

bool vkb_has_constants(const struct vkb_shader *shader)
{
    const uint32_t *end = shader->code + shader->size / sizeof *shader->code;

    for (const uint32_t *at = shader->code + SPV_HEADER_WORDS; at < end; at = vkb_next(at)) {
        if (vkb_opcode(at) == SPV_DECORATE && at[2] == SPV_SPEC_ID)
            return true;
        if (vkb_opcode(at) == SPV_FUNCTION)
            return false;
    }
    return false;
}

bool vkb_specialize(const struct vkb_shader *shader, const struct vkb_constants *constants,
                    uint32_t **code, size_t *size, struct vkb_error *error)
{
    struct module module = {.made.error = error};
    bool done = vkb_read_module(shader, &module.read, error);

    if (done) {
        module.ids = vkb_alloc(error, (size_t)module.read.bound + 1, sizeof *module.ids);
        module.stack = vkb_alloc(error, (size_t)module.read.bound + 1, sizeof *module.stack);
        done = module.ids && module.stack;
    }
    if (done) {
        read_blocks(&module);
        find_constants(&module, constants);
        do
            find_reached(&module);
        while (find_values(&module));
        find_structure(&module);
        vkb_write(&module.made, shader->code, SPV_HEADER_WORDS);
        write_declarations(&module);
        write_functions(&module);
        done = !module.made.failed;
    }
    *code = done ? module.made.words : NULL;
    *size = module.made.count * sizeof **code;
    if (!done)
        vkb_free(module.made.words);
    vkb_free(module.read.at);
    vkb_free(module.ids);
    vkb_free(module.stack);
    return done;
}
