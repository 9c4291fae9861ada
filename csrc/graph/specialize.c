#include "graph/specialize.h"

#include <string.h>

// SPIR-V 1.3: a header of five words, then instructions. The first word of an instruction is its
// number of words and its opcode.
enum {
    MAGIC = 0x07230203,
    HEADER_WORDS = 5,
    BOUND = 3,
    SPEC_ID = 1,
    GLSL_MODF = 35,
    GLSL_FREXP = 51
};

enum opcode {
    OP_SOURCE_CONTINUED = 2,
    OP_LINE = 8,
    OP_EXT_INST = 12,
    OP_ENTRY_POINT = 15,
    OP_TYPE_VOID = 19,
    OP_TYPE_BOOL,
    OP_TYPE_INT,
    OP_TYPE_FORWARD_POINTER = 39,
    OP_CONSTANT_TRUE = 41,
    OP_CONSTANT_FALSE,
    OP_CONSTANT,
    OP_SPEC_CONSTANT_TRUE = 48,
    OP_SPEC_CONSTANT_FALSE,
    OP_SPEC_CONSTANT,
    OP_SPEC_CONSTANT_OP = 52,
    OP_FUNCTION = 54,
    OP_FUNCTION_END = 56,
    OP_FUNCTION_CALL,
    OP_VARIABLE = 59,
    OP_LOAD = 61,
    OP_ACCESS_CHAIN = 65,
    OP_IN_BOUNDS_ACCESS_CHAIN,
    OP_DECORATE = 71,
    OP_VECTOR_EXTRACT_DYNAMIC = 77,
    OP_IMAGE_READ = 98,
    OP_IMAGE = 100,
    OP_IMAGE_QUERY_SAMPLES = 107,
    OP_CONVERT_F_TO_U = 109,
    OP_BITCAST = 124,
    OP_S_NEGATE = 126,
    OP_I_ADD = 128,
    OP_I_SUB = 130,
    OP_I_MUL = 132,
    OP_U_DIV = 134,
    OP_S_DIV,
    OP_U_MOD = 137,
    OP_S_REM,
    OP_S_MOD,
    OP_LOGICAL_EQUAL = 164,
    OP_LOGICAL_NOT_EQUAL,
    OP_LOGICAL_OR,
    OP_LOGICAL_AND,
    OP_LOGICAL_NOT,
    OP_SELECT,
    OP_I_EQUAL,
    OP_I_NOT_EQUAL,
    OP_U_GREATER,
    OP_S_GREATER,
    OP_U_GREATER_EQUAL,
    OP_S_GREATER_EQUAL,
    OP_U_LESS,
    OP_S_LESS,
    OP_U_LESS_EQUAL,
    OP_S_LESS_EQUAL,
    OP_SHIFT_RIGHT_LOGICAL = 194,
    OP_SHIFT_LEFT_LOGICAL = 196,
    OP_BITWISE_OR,
    OP_BITWISE_XOR,
    OP_BITWISE_AND,
    OP_NOT,
    OP_FWIDTH_COARSE = 215,
    OP_ATOMIC_LOAD = 227,
    OP_ATOMIC_STORE,
    OP_ATOMIC_XOR = 242,
    OP_PHI = 245,
    OP_LOOP_MERGE,
    OP_SELECTION_MERGE,
    OP_LABEL,
    OP_BRANCH,
    OP_BRANCH_CONDITIONAL,
    OP_SWITCH,
    OP_UNREACHABLE = 255,
    OP_NO_LINE = 317,
    OP_MODULE_PROCESSED = 330,
    OP_TERMINATE_INVOCATION = 4416,
};

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

static uint32_t opcode(const uint32_t *at)
{
    return at[0] & 0xffff;
}

static uint32_t word_count(const uint32_t *at)
{
    return at[0] >> 16;
}

static const uint32_t *next(const uint32_t *at)
{
    return at + word_count(at);
}

static bool is_debug(const uint32_t *at)
{
    const uint32_t code = opcode(at);

    return (code >= OP_SOURCE_CONTINUED && code <= OP_LINE) || code == OP_NO_LINE
        || code == OP_MODULE_PROCESSED;
}

static bool ends_block(const uint32_t *at)
{
    return (opcode(at) >= OP_BRANCH && opcode(at) <= OP_UNREACHABLE)
        || opcode(at) == OP_TERMINATE_INVOCATION;
}

// Whether an instruction without uses has no effect.
static bool is_pure(const uint32_t *at)
{
    const uint32_t code = opcode(at);

    return code == OP_PHI || code == OP_LOAD || code == OP_ACCESS_CHAIN
        || code == OP_IN_BOUNDS_ACCESS_CHAIN
        || (code == OP_EXT_INST && at[4] != GLSL_MODF && at[4] != GLSL_FREXP)
        || (code >= OP_VECTOR_EXTRACT_DYNAMIC && code <= OP_IMAGE_READ)
        || (code >= OP_IMAGE && code <= OP_IMAGE_QUERY_SAMPLES)
        || (code >= OP_CONVERT_F_TO_U && code <= OP_FWIDTH_COARSE);
}

// The result of an instruction, as far as it matters here; 0: none.
static uint32_t result(const uint32_t *at)
{
    const uint32_t code = opcode(at);

    if (code == OP_LABEL || (code >= OP_TYPE_VOID && code < OP_TYPE_FORWARD_POINTER))
        return at[1];
    return is_pure(at) || (code >= OP_CONSTANT_TRUE && code <= OP_SPEC_CONSTANT_OP)
                || (code >= OP_FUNCTION && code <= OP_VARIABLE && code != OP_FUNCTION_END)
                || (code >= OP_ATOMIC_LOAD && code <= OP_ATOMIC_XOR && code != OP_ATOMIC_STORE)
             ? at[2]
             : 0;
}

// Whether values of a type can be known.
static bool is_word(const struct module *module, uint32_t type)
{
    const uint32_t *at = module->ids[type].at;

    return at && (opcode(at) == OP_TYPE_BOOL || (opcode(at) == OP_TYPE_INT && at[2] == 32));
}

// Notes where each id is defined. Fails if an instruction or an id is outside.
static bool read_module(struct module *module)
{
    uint32_t block = 0, function = 0;

    for (const uint32_t *at = module->words + HEADER_WORDS; at < module->end; at = next(at)) {
        if (word_count(at) == 0 || word_count(at) > (size_t)(module->end - at)
            || result(at) >= module->bound)
            return false;
        struct id *id = &module->ids[result(at)];
        if (opcode(at) == OP_FUNCTION) {
            function = at[2];
            module->functions = module->functions ? module->functions : at;
        } else if (opcode(at) == OP_LABEL) {
            block = at[1];
            if (!module->ids[function].block)
                module->ids[function].block = block;
        }
        if (result(at)) {
            id->at = at;
            id->block = opcode(at) == OP_FUNCTION ? 0 : block;
        }
        if (ends_block(at)) {
            module->ids[block].end = at;
            block = 0;
        }
    }
    return module->functions != NULL;
}

static bool arithmetic(uint32_t code, uint32_t x, uint32_t y, uint32_t *value)
{
    const int32_t signed_x = (int32_t)x, signed_y = (int32_t)y;
    const bool divides = y != 0 && !((x | y) >> 31);  // where signs make no difference

    switch (code) {
    case OP_S_NEGATE:
        *value = 0 - x;
        return true;
    case OP_NOT:
        *value = ~x;
        return true;
    case OP_LOGICAL_NOT:
        *value = !x;
        return true;
    case OP_BITCAST:
        *value = x;
        return true;
    case OP_I_ADD:
        *value = x + y;
        return true;
    case OP_I_SUB:
        *value = x - y;
        return true;
    case OP_I_MUL:
        *value = x * y;
        return true;
    case OP_U_DIV:
    case OP_S_DIV:
        *value = divides ? x / y : 0;
        return divides;
    case OP_U_MOD:
    case OP_S_REM:
    case OP_S_MOD:
        *value = divides ? x % y : 0;
        return divides;
    case OP_LOGICAL_EQUAL:
    case OP_I_EQUAL:
        *value = x == y;
        return true;
    case OP_LOGICAL_NOT_EQUAL:
    case OP_I_NOT_EQUAL:
        *value = x != y;
        return true;
    case OP_LOGICAL_OR:
        *value = x || y;
        return true;
    case OP_LOGICAL_AND:
        *value = x && y;
        return true;
    case OP_U_GREATER:
        *value = x > y;
        return true;
    case OP_S_GREATER:
        *value = signed_x > signed_y;
        return true;
    case OP_U_GREATER_EQUAL:
        *value = x >= y;
        return true;
    case OP_S_GREATER_EQUAL:
        *value = signed_x >= signed_y;
        return true;
    case OP_U_LESS:
        *value = x < y;
        return true;
    case OP_S_LESS:
        *value = signed_x < signed_y;
        return true;
    case OP_U_LESS_EQUAL:
        *value = x <= y;
        return true;
    case OP_S_LESS_EQUAL:
        *value = signed_x <= signed_y;
        return true;
    case OP_SHIFT_RIGHT_LOGICAL:
        *value = y < 32 ? x >> y : 0;
        return y < 32;
    case OP_SHIFT_LEFT_LOGICAL:
        *value = y < 32 ? x << y : 0;
        return y < 32;
    case OP_BITWISE_OR:
        *value = x | y;
        return true;
    case OP_BITWISE_XOR:
        *value = x ^ y;
        return true;
    case OP_BITWISE_AND:
        *value = x & y;
        return true;
    }
    return false;
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
    for (size_t i = 0; i < 2 && (code == OP_LOGICAL_AND || code == OP_LOGICAL_OR); ++i)
        if (of[i]->known && of[i]->value == (code == OP_LOGICAL_OR)) {
            *value = code == OP_LOGICAL_OR;
            return true;
        }
    if (!of[0]->known)
        return false;
    if (code == OP_SELECT) {
        const struct id *chosen = of[0]->value ? of[1] : of[2];
        *value = chosen->value;
        return chosen->known;
    }
    if (count == 2 && !of[1]->known)
        return false;
    return count < 3 && arithmetic(code, of[0]->value, count == 2 ? of[1]->value : 0, value);
}

// The block that a branch of two targets always goes to; 0: not known. The branch that closes a
// loop stays, since a loop has one.
static uint32_t only_target(const struct module *module, const uint32_t *at)
{
    const struct id *ids = module->ids;

    if (opcode(at) != OP_BRANCH_CONDITIONAL || !ids[at[1]].known || ids[at[2]].at <= at
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
    switch (opcode(at)) {
    case OP_BRANCH:
        return i == 0 ? at[1] : 0;
    case OP_BRANCH_CONDITIONAL:
        return i < 2 ? at[2 + i] : 0;
    case OP_SWITCH:
        return 2 + 2 * i < word_count(at) ? at[2 + 2 * i] : 0;
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
        for (const uint32_t *at = block->at; at < block->end; at = next(at))
            if (opcode(at) == OP_FUNCTION_CALL)
                reach(module, module->ids[at[3]].block);
        for (uint32_t i = 0; target(module, block->end, i); ++i)
            reach(module, target(module, block->end, i));
    }
}

static bool phi_value(const struct module *module, const uint32_t *at, uint32_t *value)
{
    const struct id *found = NULL;

    for (uint32_t i = 3; i + 1 < word_count(at); i += 2) {
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

    for (const uint32_t *at = module->functions; at < module->end; at = next(at)) {
        struct id *id = &module->ids[result(at)];
        if (!is_pure(at) || id->known || !module->ids[id->block].reached || !is_word(module, at[1]))
            continue;
        id->known = opcode(at) == OP_PHI
                      ? phi_value(module, at, &id->value)
                      : evaluate(module, opcode(at), at + 3, word_count(at) - 3, &id->value);
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
    for (const uint32_t *at = module->words + HEADER_WORDS; at < module->functions; at = next(at)) {
        const uint32_t code = opcode(at);
        struct id *id = &module->ids[result(at)];
        if (code == OP_ENTRY_POINT)
            module->entry = at[2];
        else if (code == OP_DECORATE && at[2] == SPEC_ID)
            give_value(module, at, constants);
        else if (code == OP_CONSTANT || code == OP_SPEC_CONSTANT) {
            id->value = id->known ? id->value : at[3];
            id->known = is_word(module, at[1]);
        } else if (code == OP_CONSTANT_TRUE || code == OP_CONSTANT_FALSE
                   || code == OP_SPEC_CONSTANT_TRUE || code == OP_SPEC_CONSTANT_FALSE) {
            id->value = id->known ? id->value != 0
                                  : code == OP_CONSTANT_TRUE || code == OP_SPEC_CONSTANT_TRUE;
            id->known = true;
        } else if (code == OP_SPEC_CONSTANT_OP && is_word(module, at[1]))
            id->known = evaluate(module, at[3], at + 4, word_count(at) - 4, &id->value);
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
    const bool is_phi = opcode(at) == OP_PHI;

    for (uint32_t i = 1; i < word_count(at); ++i)
        if (!is_phi || i < 3 || i % 2 == 0 || follows(module, at[i + 1], module->ids[at[2]].block))
            use(module, at[i]);
}

// Notes which blocks a header names that nothing reaches.
static void keep_structure(struct module *module, const uint32_t *at, uint32_t header)
{
    struct id *ids = module->ids;

    if (!ids[at[1]].reached)
        ids[at[1]].role = MERGE_BLOCK;
    if (opcode(at) == OP_LOOP_MERGE && !ids[at[2]].reached) {
        ids[at[2]].role = CONTINUE_BLOCK;
        ids[at[2]].loop = header;
        ids[header].loop = at[2];
    }
}

// A selection whose branch always goes one way is none.
static bool stays(const struct module *module, const uint32_t *at)
{
    return opcode(at) != OP_SELECTION_MERGE || !only_target(module, next(at));
}

// Finds the instructions that what has effects uses.
static void find_used(struct module *module)
{
    uint32_t block = 0;

    for (const uint32_t *at = module->functions; at < module->end; at = next(at)) {
        if (opcode(at) == OP_LABEL)
            block = at[1];
        if (!module->ids[block].reached || is_pure(at) || !stays(module, at))
            continue;
        if (opcode(at) == OP_SELECTION_MERGE || opcode(at) == OP_LOOP_MERGE)
            keep_structure(module, at, block);
        else if (!only_target(module, at))
            use_operands(module, at);
    }
    while (module->stack_count > 0)
        use_operands(module, module->ids[module->stack[--module->stack_count]].at);
}

static uint32_t *copy(uint32_t *out, const uint32_t *at)
{
    memcpy(out, at, word_count(at) * sizeof *at);
    return out + word_count(at);
}

static uint32_t *write_constant(const struct module *module, uint32_t *out, const uint32_t *at)
{
    const bool is_bool = opcode(module->ids[at[1]].at) == OP_TYPE_BOOL;
    const uint32_t value = module->ids[at[2]].value;

    *out++ =
        is_bool ? 3 << 16 | (value ? OP_CONSTANT_TRUE : OP_CONSTANT_FALSE) : 4 << 16 | OP_CONSTANT;
    *out++ = at[1];
    *out++ = at[2];
    if (!is_bool)
        *out++ = value;
    return out;
}

static uint32_t *write_declarations(const struct module *module, uint32_t *out)
{
    for (const uint32_t *at = module->words + HEADER_WORDS; at < module->functions; at = next(at)) {
        const uint32_t code = opcode(at);
        const struct id *id = &module->ids[code == OP_DECORATE ? at[1] : result(at)];
        if (is_debug(at)
            || (code == OP_DECORATE
                && (at[2] == SPEC_ID || (id->at >= module->functions && !id->used))))
            continue;
        if (id->known && code >= OP_SPEC_CONSTANT_TRUE && code <= OP_SPEC_CONSTANT_OP)
            out = write_constant(module, out, at);
        else
            out = copy(out, at);
    }
    return out;
}

static uint32_t *write_branch(uint32_t *out, uint32_t label)
{
    *out++ = 2 << 16 | OP_BRANCH;
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
    *out++ = 1 << 16 | OP_UNREACHABLE;
    return out;
}

// Only the entries of blocks that this one follows stay. A continue block that nothing reaches
// gives the phi itself: any value would do.
static uint32_t *write_phi(const struct module *module, uint32_t *out, const uint32_t *at)
{
    const uint32_t block = module->ids[at[2]].block;
    uint32_t *first = out;

    out = copy(out, at) - (word_count(at) - 3);
    for (uint32_t i = 3; i < word_count(at); i += 2)
        if (follows(module, at[i + 1], block)) {
            *out++ = at[i];
            *out++ = at[i + 1];
        }
    if (module->ids[block].loop) {
        *out++ = at[2];
        *out++ = module->ids[block].loop;
    }
    *first = (uint32_t)(out - first) << 16 | OP_PHI;
    return out;
}

static uint32_t *write_functions(const struct module *module, uint32_t *out)
{
    bool reached = false, function_reached = false;

    for (const uint32_t *at = module->functions; at < module->end; at = next(at)) {
        const uint32_t code = opcode(at), only = only_target(module, at);
        const struct id *id = &module->ids[result(at)];
        if (code == OP_FUNCTION)
            reached = function_reached = module->ids[id->block].reached;
        else if (code == OP_FUNCTION_END)
            reached = function_reached;
        else if (code == OP_LABEL) {
            reached = id->reached;
            if (!reached)
                out = write_unreached(id, out);
        }
        if (!reached || is_debug(at) || (is_pure(at) && !id->used) || !stays(module, at))
            continue;
        out = only           ? write_branch(out, only)
            : code == OP_PHI ? write_phi(module, out, at)
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
    if (count > HEADER_WORDS && shader->code[0] == MAGIC)
        module.bound = shader->code[BOUND];
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
        memcpy(out, module.words, HEADER_WORDS * sizeof *out);
        *size = (size_t)(write_functions(&module, write_declarations(&module, out + HEADER_WORDS))
                         - out)
              * sizeof *out;
        *code = out;
    } else
        vkb_free(out);
    vkb_free(module.ids);
    vkb_free(module.stack);
    return done;
}
