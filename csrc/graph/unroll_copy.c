#include "graph/unroll_private.h"

#include <string.h>

static void put(struct vkb_unrolled *module, uint32_t word)
{
    vkb_write(&module->function, &word, 1);
}

// Whether blocks are one: the only way to the second is from the end of the first.
static bool joins(const struct vkb_unrolled *module, const uint32_t *end, uint32_t label)
{
    const struct id *to = &module->ids[label];

    return module->read.at[label] == vkb_next(end) && to->before == 1 && !to->merges;
}

static void write_branch(struct vkb_unrolled *module, const uint32_t *at, uint32_t label)
{
    if (module->read.at[label] < at) {
        module->fits &= vkb_next(at) == module->loop_end;
        module->joined = true;
    } else if (joins(module, at, label))
        module->joined = true;
    else
        VKB_WRITE(&module->function, SPV_BRANCH, vkb_go(module, label));
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

// Whether an instruction has the same result where its operands are the same.
static bool is_constant(const struct vkb_unrolled *module, const uint32_t *at)
{
    const uint32_t code = vkb_opcode(at);

    if (code != SPV_LOAD)
        return vkb_is_pure(at) && (code < SPV_SAMPLE_IMPLICIT || code > SPV_IMAGE_READ);
    const uint32_t *type = vkb_type_of(&module->read, at[3], SPV_TYPE_POINTER);
    if (!type)
        return false;
    return type[2] == SPV_UNIFORM_CONSTANT || type[2] == SPV_UNIFORM || type[2] == SPV_PUSH_CONSTANT
        || type[2] == SPV_INPUT;
}

// Whether the copy that comes last has what the one before it has, in a block that is behind.
static bool repeats(const struct vkb_unrolled *module, const uint32_t *at, size_t copy)
{
    const struct id *id = &module->ids[at[2]];
    const uint32_t *words = module->function.words;

    return id->written && is_constant(module, at) && vkb_is_behind(module, id->block)
        && memcmp(words + copy + 3, words + id->written + 3,
                  (vkb_word_count(at) - 3) * sizeof *words)
               == 0;
}

static void write_plain(struct vkb_unrolled *module, const uint32_t *at)
{
    const uint32_t result = vkb_result(at);
    const size_t copy = module->function.count;
    struct id *id = &module->ids[result];
    struct value value = {0};
    struct literals literals;

    if (vkb_is_pure(at) && vkb_evaluate(module, at, &value)) {
        id->value = value;
        return;
    }
    module->fits &= find_literals(at, &literals);
    put(module, at[0]);
    // A result comes after its type, which is not in the function.
    for (uint32_t i = 1; i < vkb_word_count(at) && module->fits; ++i)
        if ((result && i < 3) || (i >= literals.first && i - literals.first < literals.count))
            put(module, at[i]);
        else
            put(module, vkb_name_of(module, at[i]));
    if (!result || !vkb_fits(module))
        return;
    if (repeats(module, at, copy)) {
        module->function.count = copy;
        id->value = (struct value){.name = module->function.words[id->written + 2]};
        return;
    }
    module->function.words[copy + 2] = vkb_name_result(module, result);
    id->written = copy;
    id->block = module->block;
}

static void write_variable(struct vkb_unrolled *module, const uint32_t *at)
{
    const uint32_t *pointer = vkb_type_of(&module->read, at[2], SPV_TYPE_POINTER);
    const uint32_t *type = pointer ? module->read.at[pointer[3]] : NULL;
    struct id *id = &module->ids[at[2]];
    const bool is_array = type && vkb_opcode(type) == SPV_TYPE_ARRAY;

    id->elements = is_array ? module->ids[type[3]].value.number : 0;
    id->place = module->place_count + 1;
    module->place_count += is_array ? id->elements : 1;
    module->fits &=
        vkb_word_count(at) == 4 && id->elements < MAX_PLACES && module->place_count < MAX_PLACES;
}

// A pointer to an element of a local array. Returns false if it is one to something else.
static bool take_element(struct vkb_unrolled *module, const uint32_t *at)
{
    const struct id *base = &module->ids[at[3]];
    struct id *id = &module->ids[at[2]];

    id->place = 0;
    if (!base->place)
        return false;
    module->fits &= vkb_word_count(at) == 5 && at[4] < module->read.bound;
    if (!module->fits)
        return true;
    const struct value index = module->ids[at[4]].value;
    module->fits &= index.known && index.number < base->elements;
    id->place = module->fits ? base->place + index.number : 0;
    return true;
}

// Loads an element of a local array, or stores it.
static bool take_access(struct vkb_unrolled *module, const uint32_t *at)
{
    const bool loads = vkb_opcode(at) == SPV_LOAD;
    const struct id *pointer = &module->ids[at[loads ? 3 : 1]];

    if (!pointer->place || !module->fits)
        return false;
    struct place *place = &module->places[pointer->place];
    if (loads)
        module->ids[at[2]].value = place->value;
    else
        *place = (struct place){vkb_value_of(module, at[2]), module->block};
    // What was stored last must have been stored in any case.
    module->fits &= !pointer->elements && place->block && vkb_is_behind(module, place->block);
    return true;
}

static void write_phi(struct vkb_unrolled *module, const uint32_t *at)
{
    struct vkb_code *code = &module->function;
    const size_t first = code->count;
    struct value value = {0};
    bool equal = true;

    VKB_WRITE(code, SPV_PHI, at[1], 0);
    for (uint32_t i = 3; i + 1 < vkb_word_count(at) && module->fits; i += 2) {
        const struct id *from = &module->ids[at[i + 1]];
        if (!from->value.name || (from->only && from->only != module->label))
            continue;
        const struct value one = vkb_value_of(module, at[i]);
        equal &= code->count == first + 3
              || (one.known ? value.known && one.number == value.number : one.name == value.name);
        value = one;
        put(module, vkb_name_of(module, at[i]));
        put(module, from->value.name);
    }
    module->fits &= code->count > first + 3;
    if (!vkb_fits(module))
        return;
    if (equal) {
        code->count = first;
        module->ids[at[2]].value = value;
        return;
    }
    code->words[first + 2] = vkb_name_result(module, at[2]);
    vkb_end_instruction(code, first);
}

static void write_condition(struct vkb_unrolled *module, const uint32_t *at)
{
    const struct value *condition = &module->ids[at[1]].value;

    if (condition->known) {
        module->ids[module->label].only = condition->number ? at[2] : at[3];
        write_branch(module, at, module->ids[module->label].only);
        return;
    }
    const uint32_t name = vkb_name_of(module, at[1]);
    const uint32_t yes = vkb_go(module, at[2]), no = vkb_go(module, at[3]);
    VKB_WRITE(&module->function, SPV_BRANCH_CONDITIONAL, name, yes, no);
}

static void write_switch(struct vkb_unrolled *module, const uint32_t *at)
{
    put(module, at[0]);
    put(module, vkb_name_of(module, at[1]));
    // A block for other values, then each value and its block.
    for (uint32_t i = 2; i < vkb_word_count(at); ++i)
        put(module, i % 2 ? at[i] : vkb_go(module, at[i]));
}

// Where a branch always goes one way, there is no selection.
static void write_selection(struct vkb_unrolled *module, const uint32_t *at)
{
    const uint32_t *branch = vkb_next(at);

    if (vkb_opcode(branch) == SPV_BRANCH_CONDITIONAL && module->ids[branch[1]].value.known)
        return;
    VKB_WRITE(&module->function, SPV_SELECTION_MERGE, vkb_label_name(module, at[1]), at[2]);
}

void vkb_copy_instruction(struct vkb_unrolled *module, const uint32_t *at)
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
