#include "graph/unroll_private.h"

bool vkb_fits(const struct vkb_unrolled *module)
{
    return module->fits && !module->function.failed && module->function.count < MAX_WORDS;
}

bool vkb_is_local(const struct vkb_unrolled *module, uint32_t id)
{
    return id < module->read.bound && module->read.at[id]
        && module->read.at[id] > module->read.functions;
}

// A name that nothing else has: first those of the module that is read.
static uint32_t new_name(struct vkb_unrolled *module)
{
    do
        ++module->last_name;
    while (module->last_name < module->read.bound && !vkb_is_local(module, module->last_name));
    module->fits &= module->last_name < MAX_IDS;
    return module->fits ? module->last_name : 0;
}

static uint32_t constant_name(struct vkb_unrolled *module, uint32_t type, uint32_t number)
{
    for (uint32_t i = 0; i < module->constant_count; ++i) {
        const struct constant *one = &module->constants[i];
        if (one->type == type && one->number == number)
            return one->name;
    }
    module->fits &= module->constant_count < MAX_CONSTANTS;
    if (!module->fits)
        return 0;
    struct constant *one = &module->constants[module->constant_count++];
    *one = (struct constant){type, number, new_name(module)};
    return one->name;
}

struct value vkb_value_of(struct vkb_unrolled *module, uint32_t id)
{
    if (id >= module->read.bound) {
        module->fits = false;
        return (struct value){0};
    }
    const struct id *one = &module->ids[id];
    if (!vkb_is_local(module, id) && !one->value.known)
        return (struct value){.name = id};
    // A pointer to a variable that has values instead is no value itself.
    module->fits &= (one->value.known || one->value.name) && !one->place;
    return one->value;
}

uint32_t vkb_name_of(struct vkb_unrolled *module, uint32_t id)
{
    const struct value value = vkb_value_of(module, id);

    if (!value.known || !vkb_is_local(module, id))
        return value.known ? id : value.name;
    return constant_name(module, module->read.at[id][1], value.number);
}

uint32_t vkb_label_name(struct vkb_unrolled *module, uint32_t label)
{
    struct value *value = &module->ids[label].value;

    if (!value->name) {
        value->name = new_name(module);
        module->blocks[value->name] = (struct block){0};
    }
    return value->name;
}

uint32_t vkb_name_result(struct vkb_unrolled *module, uint32_t result)
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

bool vkb_evaluate(struct vkb_unrolled *module, const uint32_t *at, struct value *value)
{
    const uint32_t count = vkb_word_count(at) - 3;
    uint32_t numbers[2] = {0, 0};

    if (vkb_opcode(at) == SPV_SELECT && module->ids[at[3]].value.known) {
        *value = vkb_value_of(module, module->ids[at[3]].value.number ? at[4] : at[5]);
        return true;
    }
    if (!vkb_is_word(&module->read, at[1]) || count < 1 || count > 2)
        return false;
    for (uint32_t i = 0; i < count; ++i) {
        if (at[3 + i] >= module->read.bound || !module->ids[at[3 + i]].value.known)
            return false;
        numbers[i] = module->ids[at[3 + i]].value.number;
    }
    value->known = vkb_arithmetic(vkb_opcode(at), numbers[0], numbers[1], &value->number);
    return value->known;
}

// The block that all ways to both have in common; 0: none.
static uint32_t common(const struct vkb_unrolled *module, uint32_t a, uint32_t b)
{
    const struct block *blocks = module->blocks;

    while (a != b)
        if (blocks[a].depth >= blocks[b].depth)
            a = blocks[a].above;
        else
            b = blocks[b].above;
    return a;
}

bool vkb_is_behind(const struct vkb_unrolled *module, uint32_t block)
{
    return common(module, block, module->block) == block;
}

uint32_t vkb_go(struct vkb_unrolled *module, uint32_t label)
{
    const uint32_t name = vkb_label_name(module, label);
    struct block *block = &module->blocks[name];

    block->above = block->above ? common(module, block->above, module->block) : module->block;
    module->fits &= block->above != 0;
    return name;
}
