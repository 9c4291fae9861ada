#include "graph/specialize.h"

#include "graph/instructions.h"

#include <string.h>

// A block that nothing reaches has to stay where a header names it.
enum role { NO_ROLE, MERGE_BLOCK, CONTINUE_BLOCK };

struct id {
    const uint32_t *at;   // its instruction; NULL: none
    const uint32_t *end;  // of a label: the instruction that ends the block
    uint32_t value;       // if `known`
    uint32_t block;       // the label of its block; of a function, that of its first block
    uint32_t loop;        // between a loop's header and a continue block that nothing reaches
    bool known;           // a 32-bit integer or a bool whose value is known
    bool used;            // of an instruction in a function: it stays
    bool reached;         // of a label
    uint8_t role;         // of a label, enum role
};

struct module {
    const uint32_t *words, *end;
    const uint32_t *functions;  // the first one
    uint32_t entry;             // of the entry point
    struct id *ids;
    uint32_t bound;
    uint32_t *stack;  // of ids
    size_t stack_count;
};

// Whether values of a type can be known.
static bool is_word(const struct module *module, uint32_t type)
{
    const uint32_t *at = module->ids[type].at;

    return at
        && (vkb_opcode(at) == SPV_TYPE_BOOL || (vkb_opcode(at) == SPV_TYPE_INT && at[2] == 32));
}

// Notes where each id is defined. Fails if an instruction or an id is outside.
static bool read_module(struct module *module)
{
    uint32_t block = 0, function = 0;

    for (const uint32_t *at = module->words + SPV_HEADER_WORDS; at < module->end;
         at = vkb_next(at)) {
        if (vkb_word_count(at) == 0 || vkb_word_count(at) > (size_t)(module->end - at)
            || vkb_result(at) >= module->bound)
            return false;
        struct id *id = &module->ids[vkb_result(at)];
        if (vkb_opcode(at) == SPV_FUNCTION) {
            function = at[2];
            module->functions = module->functions ? module->functions : at;
        } else if (vkb_opcode(at) == SPV_LABEL) {
            block = at[1];
            if (!module->ids[function].block)
                module->ids[function].block = block;
        }
        if (vkb_result(at)) {
            id->at = at;
            id->block = vkb_opcode(at) == SPV_FUNCTION ? 0 : block;
        }
        if (vkb_ends_block(at)) {
            module->ids[block].end = at;
            block = 0;
        }
    }
    return module->functions != NULL;
}

// The value of an operation on ids, if it follows from what is known.
static bool evaluate(const struct module *module, uint32_t code, const uint32_t *operands,
                     size_t count, uint32_t *value)
{
    const struct id *of[3] = {0};

    if (count == 0 || count > 3)
        return false;
    for (size_t i = 0; i < count; ++i) {
        if (operands[i] >= module->bound)
            return false;
        of[i] = &module->ids[operands[i]];
    }
    // One operand decides.
    for (size_t i = 0; i < 2 && (code == SPV_LOGICAL_AND || code == SPV_LOGICAL_OR); ++i)
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
    const struct id *ids = module->ids;

    if (vkb_opcode(at) != SPV_BRANCH_CONDITIONAL || !ids[at[1]].known || ids[at[2]].at <= at
        || ids[at[3]].at <= at)
        return 0;
    return ids[at[1]].value ? at[2] : at[3];
}

// Number i of the blocks that may follow this end of a block; 0: there are no more.
static uint32_t target(const struct module *module, const uint32_t *at, uint32_t i)
{
    const uint32_t only = only_target(module, at);

    if (only)
        return i == 0 ? only : 0;
    switch (vkb_opcode(at)) {
    case SPV_BRANCH:
        return i == 0 ? at[1] : 0;
    case SPV_BRANCH_CONDITIONAL:
        return i < 2 ? at[2 + i] : 0;
    case SPV_SWITCH:
        return 2 + 2 * i < vkb_word_count(at) ? at[2 + 2 * i] : 0;
    }
    return 0;
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
    for (uint32_t i = 0; i < module->bound; ++i)
        module->ids[i].reached = false;
    reach(module, module->ids[module->entry].block);
    while (module->stack_count > 0) {
        const struct id *block = &module->ids[module->stack[--module->stack_count]];
        for (const uint32_t *at = block->at; at < block->end; at = vkb_next(at))
            if (vkb_opcode(at) == SPV_FUNCTION_CALL)
                reach(module, module->ids[at[3]].block);
        for (uint32_t i = 0; target(module, block->end, i); ++i)
            reach(module, target(module, block->end, i));
    }
}

static bool phi_value(const struct module *module, const uint32_t *at, uint32_t *value)
{
    const struct id *found = NULL;

    for (uint32_t i = 3; i + 1 < vkb_word_count(at); i += 2) {
        const struct id *one = &module->ids[at[i]];
        if (at[i] == at[2] || !follows(module, at[i + 1], module->ids[at[2]].block))
            continue;
        if (!one->known || (found && one->value != found->value))
            return false;
        found = one;
    }
    if (found)
        *value = found->value;
    return found != NULL;
}

// Finds values in the blocks that are reached. Returns whether there were new ones.
static bool find_values(struct module *module)
{
    bool more = false;

    for (const uint32_t *at = module->functions; at < module->end; at = vkb_next(at)) {
        struct id *id = &module->ids[vkb_result(at)];
        if (!vkb_is_pure(at) || id->known || !module->ids[id->block].reached
            || !is_word(module, at[1]))
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
    struct id *id = &module->ids[decoration[1]];

    for (uint32_t i = 0; i < VKB_CONSTANT_COUNT; ++i)
        if (vkb_constant_rows[i].id == decoration[3]) {
            memcpy(&id->value, (const char *)constants + vkb_constant_rows[i].offset,
                   sizeof id->value);
            id->known = true;
        }
}

static void find_constants(struct module *module, const struct vkb_constants *constants)
{
    for (const uint32_t *at = module->words + SPV_HEADER_WORDS; at < module->functions;
         at = vkb_next(at)) {
        const uint32_t code = vkb_opcode(at);
        struct id *id = &module->ids[vkb_result(at)];
        if (code == SPV_ENTRY_POINT)
            module->entry = at[2];
        else if (code == SPV_DECORATE && at[2] == SPV_SPEC_ID)
            give_value(module, at, constants);
        else if (code == SPV_CONSTANT || code == SPV_SPEC_CONSTANT) {
            id->value = id->known ? id->value : at[3];
            id->known = is_word(module, at[1]);
        } else if (code == SPV_CONSTANT_TRUE || code == SPV_CONSTANT_FALSE
                   || code == SPV_SPEC_CONSTANT_TRUE || code == SPV_SPEC_CONSTANT_FALSE) {
            id->value = id->known ? id->value != 0
                                  : code == SPV_CONSTANT_TRUE || code == SPV_SPEC_CONSTANT_TRUE;
            id->known = true;
        } else if (code == SPV_SPEC_CONSTANT_OP && is_word(module, at[1]))
            id->known = evaluate(module, at[3], at + 4, vkb_word_count(at) - 4, &id->value);
    }
}

static void use(struct module *module, uint32_t word)
{
    struct id *id = &module->ids[word < module->bound ? word : 0];

    if (id->used || !id->block || !module->ids[id->block].reached)
        return;
    id->used = true;
    module->stack[module->stack_count++] = word;
}

// Uses all operands. A number among them may equal an id: then an instruction too many stays.
static void use_operands(struct module *module, const uint32_t *at)
{
    const bool is_phi = vkb_opcode(at) == SPV_PHI;

    for (uint32_t i = 1; i < vkb_word_count(at); ++i)
        if (!is_phi || i < 3 || i % 2 == 0 || follows(module, at[i + 1], module->ids[at[2]].block))
            use(module, at[i]);
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

// Finds the instructions that what has effects uses.
static void find_used(struct module *module)
{
    uint32_t block = 0;

    for (const uint32_t *at = module->functions; at < module->end; at = vkb_next(at)) {
        if (vkb_opcode(at) == SPV_LABEL)
            block = at[1];
        if (!module->ids[block].reached || vkb_is_pure(at) || !stays(module, at))
            continue;
        if (vkb_opcode(at) == SPV_SELECTION_MERGE || vkb_opcode(at) == SPV_LOOP_MERGE)
            keep_structure(module, at, block);
        else if (!only_target(module, at))
            use_operands(module, at);
    }
    while (module->stack_count > 0)
        use_operands(module, module->ids[module->stack[--module->stack_count]].at);
}

static uint32_t *copy(uint32_t *out, const uint32_t *at)
{
    memcpy(out, at, vkb_word_count(at) * sizeof *at);
    return out + vkb_word_count(at);
}

static uint32_t *write_constant(const struct module *module, uint32_t *out, const uint32_t *at)
{
    const bool is_bool = vkb_opcode(module->ids[at[1]].at) == SPV_TYPE_BOOL;
    const uint32_t value = module->ids[at[2]].value;

    *out++ = is_bool ? 3 << 16 | (value ? SPV_CONSTANT_TRUE : SPV_CONSTANT_FALSE)
                     : 4 << 16 | SPV_CONSTANT;
    *out++ = at[1];
    *out++ = at[2];
    if (!is_bool)
        *out++ = value;
    return out;
}

static uint32_t *write_declarations(const struct module *module, uint32_t *out)
{
    for (const uint32_t *at = module->words + SPV_HEADER_WORDS; at < module->functions;
         at = vkb_next(at)) {
        const uint32_t code = vkb_opcode(at);
        const struct id *id = &module->ids[code == SPV_DECORATE ? at[1] : vkb_result(at)];
        if (vkb_is_debug(at)
            || (code == SPV_DECORATE
                && (at[2] == SPV_SPEC_ID || (id->at >= module->functions && !id->used))))
            continue;
        if (id->known && code >= SPV_SPEC_CONSTANT_TRUE && code <= SPV_SPEC_CONSTANT_OP)
            out = write_constant(module, out, at);
        else
            out = copy(out, at);
    }
    return out;
}

static uint32_t *write_branch(uint32_t *out, uint32_t label)
{
    *out++ = 2 << 16 | SPV_BRANCH;
    *out++ = label;
    return out;
}

// A block that only the structure needs.
static uint32_t *write_unreached(const struct id *label, uint32_t *out)
{
    if (label->role == NO_ROLE)
        return out;
    out = copy(out, label->at);
    if (label->role == CONTINUE_BLOCK)
        return write_branch(out, label->loop);
    *out++ = 1 << 16 | SPV_UNREACHABLE;
    return out;
}

// Only the entries of blocks that this one follows stay. A continue block that nothing reaches
// gives the phi itself: any value would do.
static uint32_t *write_phi(const struct module *module, uint32_t *out, const uint32_t *at)
{
    const uint32_t block = module->ids[at[2]].block;
    uint32_t *first = out;

    out = copy(out, at) - (vkb_word_count(at) - 3);
    for (uint32_t i = 3; i < vkb_word_count(at); i += 2)
        if (follows(module, at[i + 1], block)) {
            *out++ = at[i];
            *out++ = at[i + 1];
        }
    if (module->ids[block].loop) {
        *out++ = at[2];
        *out++ = module->ids[block].loop;
    }
    *first = (uint32_t)(out - first) << 16 | SPV_PHI;
    return out;
}

static uint32_t *write_functions(const struct module *module, uint32_t *out)
{
    bool reached = false, function_reached = false;

    for (const uint32_t *at = module->functions; at < module->end; at = vkb_next(at)) {
        const uint32_t code = vkb_opcode(at), only = only_target(module, at);
        const struct id *id = &module->ids[vkb_result(at)];
        if (code == SPV_FUNCTION)
            reached = function_reached = module->ids[id->block].reached;
        else if (code == SPV_FUNCTION_END)
            reached = function_reached;
        else if (code == SPV_LABEL) {
            reached = id->reached;
            if (!reached)
                out = write_unreached(id, out);
        }
        if (!reached || vkb_is_debug(at) || (vkb_is_pure(at) && !id->used) || !stays(module, at))
            continue;
        out = only            ? write_branch(out, only)
            : code == SPV_PHI ? write_phi(module, out, at)
                              : copy(out, at);
    }
    return out;
}

bool vkb_specialize(const struct vkb_shader *shader, const struct vkb_constants *constants,
                    uint32_t **code, size_t *size, struct vkb_error *error)
{
    const size_t count = shader->size / sizeof *shader->code;
    struct module module = {.words = shader->code, .end = shader->code + count};

    *code = NULL;
    if (count > SPV_HEADER_WORDS && shader->code[0] == SPV_MAGIC)
        module.bound = shader->code[SPV_BOUND];
    module.ids = vkb_alloc(error, (size_t)module.bound + 1, sizeof *module.ids);
    module.stack = vkb_alloc(error, (size_t)module.bound + 1, sizeof *module.stack);
    uint32_t *out = vkb_alloc(error, count, sizeof *out);
    bool done = module.ids && module.stack && out;
    if (done && !read_module(&module))
        done = vkb_fail(error, VKB_ERROR_SHADER, "%s is not SPIR-V", shader->name);
    if (done) {
        find_constants(&module, constants);
        do
            find_reached(&module);
        while (find_values(&module));
        find_used(&module);
        memcpy(out, module.words, SPV_HEADER_WORDS * sizeof *out);
        *size =
            (size_t)(write_functions(&module, write_declarations(&module, out + SPV_HEADER_WORDS))
                     - out)
            * sizeof *out;
        *code = out;
    } else
        vkb_free(out);
    vkb_free(module.ids);
    vkb_free(module.stack);
    return done;
}
