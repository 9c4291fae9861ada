#include "graph/unroll.h"

#include "graph/instructions.h"

#include <string.h>

// What is larger stays as it is.
enum {
    MOST_WORDS = 1 << 18,
    MOST_IDS = 1 << 16,
    MOST_PLACES = 1 << 10,
    MOST_CONSTANTS = 1 << 10,
    MOST_PHIS = 64,
    MOST_ITERATIONS = 1 << 10,
};

// What an operand stands for in the copy of its instruction that was written last.
struct value {
    uint32_t name;    // of the result, of a block; 0: none yet
    uint32_t number;  // if `known`: an integer or a bool, which has no name
    bool known;
};

// An id of the module that is read.
struct id {
    const uint32_t *at;     // its instruction; NULL: none
    const uint32_t *merge;  // of a label: how its loop is declared; NULL: it has none
    uint32_t before;        // of a label: the branches to it from blocks before it
    bool merges;            // of a label: a selection ends there
    bool decorated;
    uint32_t copies;  // of what is decorated: its last copy
    struct value value;
    uint32_t *written;  // of an instruction: its last copy, and in which block
    uint32_t block;
    uint32_t only;      // of a label: the one block that may follow; 0: any
    uint32_t place;     // of a pointer to a local variable: its first element
    uint32_t elements;  // of an array: their number
};

// A block that is written. `above` is the last one that all ways to it have in common.
struct block {
    uint32_t above, depth;
};

// An element of a local variable: its value, and the block that stored it.
struct place {
    struct value value;
    uint32_t block;
};

struct copy {
    uint32_t name, before;
};

struct constant {
    uint32_t type, number, name;
};

struct module {
    const uint32_t *words, *end;
    const uint32_t *functions;  // the first one
    const uint32_t *loop_end;   // of the innermost loop that is written
    uint32_t bound, last_name;
    struct id *ids;
    struct block *blocks;  // by their names
    struct copy *copies;
    struct place places[MOST_PLACES];
    struct constant constants[MOST_CONSTANTS];
    uint32_t place_count, copy_count, constant_count, declared_count;
    uint32_t *out, *written;
    uint32_t label, block;  // of the block that is written: its label, its name
    bool joined;            // the next block goes on with this one
    bool fits;
};

static bool is_local(const struct module *module, uint32_t id)
{
    return id < module->bound && module->ids[id].at && module->ids[id].at > module->functions;
}

// A name that nothing else has: first those of the module that is read.
static uint32_t new_name(struct module *module)
{
    do
        ++module->last_name;
    while (module->last_name < module->bound && !is_local(module, module->last_name));
    module->fits &= module->last_name < MOST_IDS;
    return module->fits ? module->last_name : 0;
}

static uint32_t constant_name(struct module *module, uint32_t type, uint32_t number)
{
    for (uint32_t i = 0; i < module->constant_count; ++i) {
        const struct constant *one = &module->constants[i];
        if (one->type == type && one->number == number)
            return one->name;
    }
    module->fits &= module->constant_count < MOST_CONSTANTS;
    if (!module->fits)
        return 0;
    struct constant *one = &module->constants[module->constant_count++];
    *one = (struct constant){type, number, new_name(module)};
    return one->name;
}

static struct value value_of(struct module *module, uint32_t id)
{
    if (id >= module->bound) {
        module->fits = false;
        return (struct value){0};
    }
    const struct id *one = &module->ids[id];
    if (!is_local(module, id) && !one->value.known)
        return (struct value){.name = id};
    // A pointer to a variable that has values instead is no value itself.
    module->fits &= (one->value.known || one->value.name) && !one->place;
    return one->value;
}

static uint32_t name_of(struct module *module, uint32_t id)
{
    const struct value value = value_of(module, id);

    if (!value.known || !is_local(module, id))
        return value.known ? id : value.name;
    return constant_name(module, module->ids[id].at[1], value.number);
}

static uint32_t label_name(struct module *module, uint32_t label)
{
    struct value *value = &module->ids[label].value;

    if (!value->name) {
        value->name = new_name(module);
        module->blocks[value->name] = (struct block){0};
    }
    return value->name;
}

static void put(struct module *module, uint32_t word)
{
    if (module->written < module->out + MOST_WORDS)
        *module->written++ = word;
    else
        module->fits = false;
}

static void put_all(struct module *module, const uint32_t *at, const uint32_t *end)
{
    while (at < end)
        put(module, *at++);
}

// The block that all ways to both have in common; 0: none.
static uint32_t common(const struct module *module, uint32_t a, uint32_t b)
{
    const struct block *blocks = module->blocks;

    while (a != b)
        if (blocks[a].depth >= blocks[b].depth)
            a = blocks[a].above;
        else
            b = blocks[b].above;
    return a;
}

// Notes that this block may go on with another, and returns the other's name.
static uint32_t go(struct module *module, uint32_t label)
{
    const uint32_t name = label_name(module, label);
    struct block *block = &module->blocks[name];

    block->above = block->above ? common(module, block->above, module->block) : module->block;
    module->fits &= block->above != 0;
    return name;
}

// Whether blocks are one: the only way to the second is from the end of the first.
static bool joins(const struct module *module, const uint32_t *end, uint32_t label)
{
    const struct id *to = &module->ids[label];

    return to->at == vkb_next(end) && to->before == 1 && !to->merges;
}

static void write_branch(struct module *module, const uint32_t *at, uint32_t label)
{
    if (module->ids[label].at < at) {
        module->fits &= vkb_next(at) == module->loop_end;
        module->joined = true;
    } else if (joins(module, at, label))
        module->joined = true;
    else {
        put(module, 2 << 16 | SPV_BRANCH);
        put(module, go(module, label));
    }
}

// Starts a block. Returns whether anything leads to it in this copy.
static bool begin_block(struct module *module, uint32_t label)
{
    struct id *id = &module->ids[label];

    module->label = label;
    id->only = 0;
    if (module->joined)
        id->value.name = module->block;
    else if (id->value.name) {
        module->block = id->value.name;
        put(module, 2 << 16 | SPV_LABEL);
        put(module, module->block);
        module->blocks[module->block].depth =
            module->blocks[module->blocks[module->block].above].depth + 1;
    }
    module->joined = false;
    return id->value.name != 0;
}

static bool is_word(const struct module *module, uint32_t type)
{
    const uint32_t *at = type < module->bound ? module->ids[type].at : NULL;

    return at
        && (vkb_opcode(at) == SPV_TYPE_BOOL || (vkb_opcode(at) == SPV_TYPE_INT && at[2] == 32));
}

// Whether an instruction has a result that follows from what is known: its value.
static bool evaluate(struct module *module, const uint32_t *at, struct value *value)
{
    const uint32_t count = vkb_word_count(at) - 3;
    uint32_t numbers[2] = {0, 0};

    if (vkb_opcode(at) == SPV_SELECT && module->ids[at[3]].value.known) {
        *value = value_of(module, module->ids[at[3]].value.number ? at[4] : at[5]);
        return true;
    }
    if (!is_word(module, at[1]) || count < 1 || count > 2)
        return false;
    for (uint32_t i = 0; i < count; ++i) {
        if (at[3 + i] >= module->bound || !module->ids[at[3 + i]].value.known)
            return false;
        numbers[i] = module->ids[at[3 + i]].value.number;
    }
    value->known = vkb_arithmetic(vkb_opcode(at), numbers[0], numbers[1], &value->number);
    return value->known;
}

// Words of an instruction that are no ids: `count` from number `first`, or all from there.
struct literals {
    uint32_t first, count;
};

// Returns false for instructions that shaders of the package do not have.
static bool find_literals(const uint32_t *at, struct literals *literals)
{
    const uint32_t code = vkb_opcode(at);

    *literals = (struct literals){vkb_word_count(at), 0};
    if (code == SPV_LOAD || code == SPV_COMPOSITE_EXTRACT)
        *literals = (struct literals){4, UINT32_MAX};
    else if (code == SPV_STORE)
        *literals = (struct literals){3, UINT32_MAX};
    else if (code == SPV_VECTOR_SHUFFLE || code == SPV_COMPOSITE_INSERT)
        *literals = (struct literals){5, UINT32_MAX};
    else if (code == SPV_EXT_INST || code == SPV_IMAGE_WRITE)
        *literals = (struct literals){4, 1};
    else if (code == SPV_IMAGE_FETCH || code == SPV_IMAGE_READ || code == SPV_SAMPLE_IMPLICIT
             || code == SPV_SAMPLE_EXPLICIT)
        *literals = (struct literals){5, 1};
    else if (code == SPV_IMAGE_GATHER)
        *literals = (struct literals){6, 1};
    else
        return (vkb_is_pure(at) && (code < SPV_SAMPLE_DREF_IMPLICIT || code > SPV_IMAGE_READ))
            || code == SPV_CONTROL_BARRIER || code == SPV_MEMORY_BARRIER || code == SPV_RETURN
            || code == SPV_UNREACHABLE || code == SPV_KILL;
    return true;
}

// Gives the result of an instruction a new name, also for its decorations.
static uint32_t name_result(struct module *module, uint32_t result)
{
    struct id *id = &module->ids[result];
    const uint32_t name = new_name(module);

    id->value = (struct value){.name = name};
    if (id->decorated && module->fits) {
        module->copies[++module->copy_count] = (struct copy){name, id->copies};
        id->copies = module->copy_count;
    }
    return name;
}

// Whether an instruction has the same result where its operands are the same.
static bool is_constant(const struct module *module, const uint32_t *at)
{
    const uint32_t code = vkb_opcode(at);

    if (code != SPV_LOAD)
        return vkb_is_pure(at) && (code < SPV_SAMPLE_IMPLICIT || code > SPV_IMAGE_READ);
    const uint32_t *type = module->ids[module->ids[at[3]].at[1]].at;
    return type[2] == SPV_UNIFORM_CONSTANT || type[2] == SPV_UNIFORM || type[2] == SPV_PUSH_CONSTANT
        || type[2] == SPV_INPUT;
}

// Whether the copy that comes last has what the one before it has, in a block that is behind.
static bool repeats(const struct module *module, const struct id *id, uint32_t count)
{
    const uint32_t *copy = module->written - count;

    return id->written && is_constant(module, id->at)
        && common(module, id->block, module->block) == id->block
        && memcmp(copy + 3, id->written + 3, (count - 3) * sizeof *copy) == 0;
}

static void write_plain(struct module *module, const uint32_t *at)
{
    const uint32_t result = vkb_result(at), count = vkb_word_count(at);
    struct id *id = &module->ids[result];
    struct value value = {0};
    struct literals literals;

    if (vkb_is_pure(at) && evaluate(module, at, &value)) {
        id->value = value;
        return;
    }
    module->fits &= find_literals(at, &literals);
    put(module, at[0]);
    // A result comes after its type, which is not in the function.
    for (uint32_t i = 1; i < count && module->fits; ++i)
        if ((result && i < 3) || (i >= literals.first && i - literals.first < literals.count))
            put(module, at[i]);
        else
            put(module, name_of(module, at[i]));
    if (!result || !module->fits)
        return;
    if (repeats(module, id, count)) {
        module->written -= count;
        id->value = (struct value){.name = id->written[2]};
        return;
    }
    id->written = module->written - count;
    id->written[2] = name_result(module, result);
    id->block = module->block;
}

static void write_variable(struct module *module, const uint32_t *at)
{
    const uint32_t *type = module->ids[module->ids[at[1]].at[3]].at;
    struct id *id = &module->ids[at[2]];
    const bool is_array = type && vkb_opcode(type) == SPV_TYPE_ARRAY;

    id->elements = is_array ? module->ids[type[3]].value.number : 0;
    id->place = module->place_count + 1;
    module->place_count += is_array ? id->elements : 1;
    module->fits &=
        vkb_word_count(at) == 4 && id->elements < MOST_PLACES && module->place_count < MOST_PLACES;
}

// A pointer to an element of a local array. Returns false if it is one to something else.
static bool take_element(struct module *module, const uint32_t *at)
{
    const struct id *base = &module->ids[at[3]];
    struct id *id = &module->ids[at[2]];

    id->place = 0;
    if (!base->place)
        return false;
    const struct value index = module->ids[at[4]].value;
    module->fits &= vkb_word_count(at) == 5 && index.known && index.number < base->elements;
    id->place = base->place + index.number;
    return true;
}

// Loads an element of a local array, or stores it.
static bool take_access(struct module *module, const uint32_t *at)
{
    const bool loads = vkb_opcode(at) == SPV_LOAD;
    const struct id *pointer = &module->ids[at[loads ? 3 : 1]];

    if (!pointer->place || !module->fits)
        return false;
    struct place *place = &module->places[pointer->place];
    if (loads)
        module->ids[at[2]].value = place->value;
    else
        *place = (struct place){value_of(module, at[2]), module->block};
    // What was stored last must have been stored in any case.
    module->fits &= !pointer->elements && place->block
                 && common(module, place->block, module->block) == place->block;
    return true;
}

static void write_phi(struct module *module, const uint32_t *at)
{
    uint32_t *words = module->written, count = 0;
    struct value value = {0};
    bool equal = true;

    put(module, at[0]);
    put(module, at[1]);
    put(module, 0);
    for (uint32_t i = 3; i + 1 < vkb_word_count(at) && module->fits; i += 2) {
        const struct id *from = &module->ids[at[i + 1]];
        if (!from->value.name || (from->only && from->only != module->label))
            continue;
        const struct value one = value_of(module, at[i]);
        equal &= count == 0
              || (one.known ? value.known && one.number == value.number : one.name == value.name);
        value = one;
        ++count;
        put(module, name_of(module, at[i]));
        put(module, from->value.name);
    }
    module->fits &= count > 0;
    if (!module->fits)
        return;
    if (equal) {
        module->written = words;
        module->ids[at[2]].value = value;
        return;
    }
    words[0] = (3 + 2 * count) << 16 | SPV_PHI;
    words[2] = name_result(module, at[2]);
}

static void write_condition(struct module *module, const uint32_t *at)
{
    const struct value *condition = &module->ids[at[1]].value;

    if (condition->known) {
        module->ids[module->label].only = condition->number ? at[2] : at[3];
        write_branch(module, at, module->ids[module->label].only);
        return;
    }
    put(module, 4 << 16 | SPV_BRANCH_CONDITIONAL);
    put(module, name_of(module, at[1]));
    put(module, go(module, at[2]));
    put(module, go(module, at[3]));
}

static void write_switch(struct module *module, const uint32_t *at)
{
    put(module, at[0]);
    put(module, name_of(module, at[1]));
    put(module, go(module, at[2]));
    for (uint32_t i = 3; i + 1 < vkb_word_count(at); i += 2) {
        put(module, at[i]);
        put(module, go(module, at[i + 1]));
    }
}

// Where a branch always goes one way, there is no selection.
static void write_selection(struct module *module, const uint32_t *at)
{
    const uint32_t *branch = vkb_next(at);

    if (vkb_opcode(branch) == SPV_BRANCH_CONDITIONAL && module->ids[branch[1]].value.known)
        return;
    put(module, at[0]);
    put(module, label_name(module, at[1]));
    put(module, at[2]);
}

static void write_instruction(struct module *module, const uint32_t *at)
{
    switch (vkb_opcode(at)) {
    case SPV_VARIABLE:
        write_variable(module, at);
        return;
    case SPV_ACCESS_CHAIN:
    case SPV_IN_BOUNDS_ACCESS_CHAIN:
        if (!take_element(module, at))
            write_plain(module, at);
        return;
    case SPV_LOAD:
    case SPV_STORE:
        if (!take_access(module, at))
            write_plain(module, at);
        return;
    case SPV_PHI:
        write_phi(module, at);
        return;
    case SPV_SELECTION_MERGE:
        write_selection(module, at);
        return;
    case SPV_BRANCH:
        write_branch(module, at, at[1]);
        return;
    case SPV_BRANCH_CONDITIONAL:
        write_condition(module, at);
        return;
    case SPV_SWITCH:
        write_switch(module, at);
        return;
    default:
        write_plain(module, at);
    }
}

// Takes the values that an iteration starts with, and returns the first instruction after them.
static const uint32_t *start_iteration(struct module *module, const uint32_t *header, bool first)
{
    struct value values[MOST_PHIS];
    uint32_t count = 0;
    const uint32_t *at = vkb_next(header);

    for (; vkb_opcode(at) == SPV_PHI && count < MOST_PHIS; at = vkb_next(at)) {
        const uint32_t other = (module->ids[at[4]].at < header) == first ? 3 : 5;
        module->fits &= vkb_word_count(at) == 7;
        if (module->fits)
            values[count++] = value_of(module, at[other]);
    }
    // All at a time: one may be the start of another.
    at = vkb_next(header);
    for (uint32_t i = 0; i < count; ++i, at = vkb_next(at))
        module->ids[at[2]].value = values[i];
    return at;
}

static void write_range(struct module *module, const uint32_t *at, const uint32_t *end);

// Whether a loop starts with its condition, and is left only there.
static bool can_unroll(const struct module *module, const uint32_t *header)
{
    const struct id *ids = module->ids;
    const uint32_t *merge = ids[header[1]].merge, *branch = vkb_next(merge);

    return (merge[3] & SPV_UNROLL) != 0 && vkb_opcode(branch) == SPV_BRANCH_CONDITIONAL
        && ids[header[1]].before == 1 && ids[merge[1]].before == 1 && ids[merge[2]].before == 1
        && ids[merge[1]].at > branch && ids[branch[2]].at == vkb_next(branch);
}

// Returns the label of the block after the loop.
static const uint32_t *write_loop(struct module *module, const uint32_t *header)
{
    struct id *ids = module->ids;
    const uint32_t *merge = ids[header[1]].merge, *branch = vkb_next(merge);
    const uint32_t *body = vkb_next(branch), *end = ids[merge[1]].at, *outer = module->loop_end;

    module->fits &= can_unroll(module, header);
    for (uint32_t i = 0; module->fits; ++i) {
        if (i > 0)
            begin_block(module, header[1]);
        for (const uint32_t *at = start_iteration(module, header, i == 0); at < merge;
             at = vkb_next(at))
            write_instruction(module, at);
        module->fits &= ids[branch[1]].value.known && i < MOST_ITERATIONS;
        if (!module->fits || !ids[branch[1]].value.number)
            break;
        for (const uint32_t *at = body; at < end; at = vkb_next(at))
            if (vkb_opcode(at) == SPV_LABEL)
                ids[at[1]].value.name = 0;
        module->loop_end = end;
        module->joined = true;
        write_range(module, body, end);
        module->fits &= module->joined;
    }
    module->loop_end = outer;
    module->joined = !ids[merge[1]].merges;
    if (!module->joined) {
        put(module, 2 << 16 | SPV_BRANCH);
        put(module, go(module, merge[1]));
    }
    return end;
}

static void write_range(struct module *module, const uint32_t *at, const uint32_t *end)
{
    while (at < end && module->fits)
        if (vkb_opcode(at) == SPV_LABEL && !begin_block(module, at[1])) {
            while (!vkb_ends_block(at))
                at = vkb_next(at);
            at = vkb_next(at);
        } else if (vkb_opcode(at) == SPV_LABEL && module->ids[at[1]].merge)
            at = write_loop(module, at);
        else {
            if (vkb_opcode(at) != SPV_LABEL)
                write_instruction(module, at);
            at = vkb_next(at);
        }
}

static void read_declaration(struct module *module, const uint32_t *at)
{
    const uint32_t code = vkb_opcode(at);
    struct value *value = &module->ids[vkb_result(at)].value;

    if (code == SPV_DECORATE && at[1] < module->bound)
        module->ids[at[1]].decorated = true;
    value->known = code == SPV_CONSTANT_TRUE || code == SPV_CONSTANT_FALSE
                || (code == SPV_CONSTANT && is_word(module, at[1]));
    if (!value->known)
        return;
    value->number = code == SPV_CONSTANT ? at[3] : code == SPV_CONSTANT_TRUE;
    module->fits &= module->constant_count < MOST_CONSTANTS;
    if (module->fits)
        module->constants[module->constant_count++] =
            (struct constant){at[1], value->number, at[2]};
}

static void read_branch(struct module *module, uint32_t label)
{
    // Blocks before this one have been read.
    if (label < module->bound && !module->ids[label].at)
        ++module->ids[label].before;
}

static void read_end(struct module *module, const uint32_t *at)
{
    const uint32_t code = vkb_opcode(at);

    for (uint32_t i = code == SPV_BRANCH ? 1 : 2; i < vkb_word_count(at); ++i)
        if (code == SPV_BRANCH || (code == SPV_BRANCH_CONDITIONAL && i < 4)
            || (code == SPV_SWITCH && i % 2 == 0))
            read_branch(module, at[i]);
}

// Returns whether all code is in one function.
static bool read_module(struct module *module)
{
    uint32_t label = 0, functions = 0;

    for (const uint32_t *at = module->words + SPV_HEADER_WORDS; at < module->end;
         at = vkb_next(at)) {
        const uint32_t code = vkb_opcode(at);
        module->ids[vkb_result(at)].at = at;
        if (code == SPV_FUNCTION && functions++ == 0)
            module->functions = at;
        if (functions == 0)
            read_declaration(module, at);
        if (code == SPV_LABEL)
            label = at[1];
        else if (code == SPV_LOOP_MERGE)
            module->ids[label].merge = at;
        else if (code == SPV_SELECTION_MERGE)
            module->ids[at[1]].merges = true;
        else if (vkb_ends_block(at))
            read_end(module, at);
    }
    module->declared_count = module->constant_count;
    return module->fits && functions == 1;
}

// A decoration of each copy of what it decorates.
static void write_decoration(struct module *module, const uint32_t *at)
{
    for (uint32_t i = module->ids[at[1]].copies; i; i = module->copies[i].before) {
        put(module, at[0]);
        put(module, module->copies[i].name);
        put_all(module, at + 2, vkb_next(at));
    }
}

static void write_declarations(struct module *module)
{
    put_all(module, module->words, module->words + SPV_HEADER_WORDS);
    for (const uint32_t *at = module->words + SPV_HEADER_WORDS; at < module->functions;
         at = vkb_next(at))
        if (vkb_opcode(at) == SPV_DECORATE && is_local(module, at[1]))
            write_decoration(module, at);
        else
            put_all(module, at, vkb_next(at));
    for (uint32_t i = module->declared_count; i < module->constant_count; ++i) {
        const struct constant *one = &module->constants[i];
        const bool is_bool = vkb_opcode(module->ids[one->type].at) == SPV_TYPE_BOOL;
        put(module, is_bool ? 3 << 16 | (one->number ? SPV_CONSTANT_TRUE : SPV_CONSTANT_FALSE)
                            : 4 << 16 | SPV_CONSTANT);
        put(module, one->type);
        put(module, one->name);
        if (!is_bool)
            put(module, one->number);
    }
}

static void write_function(struct module *module)
{
    const uint32_t *first = vkb_next(module->functions), *end = first;

    put_all(module, module->functions, first);
    label_name(module, first[1]);
    while (vkb_opcode(end) != SPV_FUNCTION_END)
        end = vkb_next(end);
    write_range(module, first, end);
    put(module, end[0]);
}

static bool has_loop(const uint32_t *at, const uint32_t *end)
{
    while (at < end && vkb_opcode(at) != SPV_LOOP_MERGE)
        at = vkb_next(at);
    return at < end;
}

static void destroy(struct module *module)
{
    vkb_free(module->ids);
    vkb_free(module->blocks);
    vkb_free(module->copies);
    vkb_free(module->out);
    vkb_free(module);
}

static struct module *create(const uint32_t *code, size_t count, struct vkb_error *error)
{
    struct module *module = vkb_alloc(error, 1, sizeof *module);

    if (!module)
        return NULL;
    module->words = code;
    module->end = code + count;
    module->bound = code[SPV_BOUND];
    module->fits = module->bound < MOST_IDS;
    module->ids = vkb_alloc(error, module->bound, sizeof *module->ids);
    // (vkb_alloc would write to all of it.)
    size_t words = 0, blocks = 0, copies = 0;
    if (module->ids && vkb_grow(error, &module->out, &words, MOST_WORDS, sizeof *module->out)
        && vkb_grow(error, &module->blocks, &blocks, MOST_IDS, sizeof *module->blocks)
        && vkb_grow(error, &module->copies, &copies, MOST_IDS, sizeof *module->copies)) {
        module->blocks[0] = (struct block){0};
        module->written = module->out;
        return module;
    }
    destroy(module);
    return NULL;
}

// Makes a module of the function and the declarations, which are written in this order.
static bool join(struct module *module, const uint32_t *declarations, uint32_t **code, size_t *size,
                 struct vkb_error *error)
{
    const size_t first = (size_t)(module->written - declarations);
    const size_t second = (size_t)(declarations - module->out);
    uint32_t *joined = vkb_alloc(error, first + second, sizeof *joined);

    if (!joined)
        return false;
    memcpy(joined, declarations, first * sizeof *joined);
    memcpy(joined + first, module->out, second * sizeof *joined);
    if (joined[SPV_BOUND] <= module->last_name)
        joined[SPV_BOUND] = module->last_name + 1;
    vkb_free(*code);
    *code = joined;
    *size = (first + second) * sizeof *joined;
    return true;
}

bool vkb_unroll(uint32_t **code, size_t *size, struct vkb_error *error)
{
    const size_t count = *size / sizeof **code;
    bool done = true;

    if (!has_loop(*code + SPV_HEADER_WORDS, *code + count))
        return true;
    struct module *module = create(*code, count, error);
    if (!module)
        return false;
    if (read_module(module)) {
        write_function(module);
        const uint32_t *declarations = module->written;
        write_declarations(module);
        done = !module->fits || join(module, declarations, code, size, error);
    }
    destroy(module);
    return done;
}
