#include "graph/unroll.h"

#include "graph/unroll_private.h"

// Starts a block. Returns whether anything leads to it in this copy.
static bool begin_block(struct vkb_unrolled *module, uint32_t label)
{
    struct id *id = &module->ids[label];

    module->label = label;
    id->only = 0;
    if (module->joined)
        id->value.name = module->block;
    else if (id->value.name) {
        module->block = id->value.name;
        VKB_WRITE(&module->function, SPV_LABEL, module->block);
        module->blocks[module->block].depth =
            module->blocks[module->blocks[module->block].above].depth + 1;
    }
    module->joined = false;
    return id->value.name != 0;
}

// Takes the values that an iteration starts with, and returns the first instruction after them.
static const uint32_t *start_iteration(struct vkb_unrolled *module, const uint32_t *header,
                                       bool first)
{
    struct value values[MAX_PHIS];
    uint32_t count = 0;
    const uint32_t *at = vkb_next(header);

    for (; vkb_opcode(at) == SPV_PHI && count < MAX_PHIS; at = vkb_next(at)) {
        const uint32_t other = (module->read.at[at[4]] < header) == first ? 3 : 5;
        module->fits &= vkb_word_count(at) == 7;
        if (module->fits)
            values[count++] = vkb_value_of(module, at[other]);
    }
    // All at a time: one may be the start of another.
    at = vkb_next(header);
    for (uint32_t i = 0; i < count; ++i, at = vkb_next(at))
        module->ids[at[2]].value = values[i];
    return at;
}

static void write_range(struct vkb_unrolled *module, const uint32_t *at, const uint32_t *end);

// Whether a loop starts with its condition, and is left only there.
static bool can_unroll(const struct vkb_unrolled *module, const uint32_t *header)
{
    const struct id *ids = module->ids;
    const uint32_t *merge = ids[header[1]].merge, *branch = vkb_next(merge);
    const uint32_t *const *labels = module->read.at;

    return (merge[3] & SPV_UNROLL) != 0 && vkb_opcode(branch) == SPV_BRANCH_CONDITIONAL
        && ids[header[1]].before == 1 && ids[merge[1]].before == 1 && ids[merge[2]].before == 1
        && labels[merge[1]] > branch && labels[branch[2]] == vkb_next(branch);
}

// Returns the label of the block after the loop.
static const uint32_t *write_loop(struct vkb_unrolled *module, const uint32_t *header)
{
    struct id *ids = module->ids;
    const uint32_t *merge = ids[header[1]].merge, *branch = vkb_next(merge);
    const uint32_t *body = vkb_next(branch), *end = module->read.at[merge[1]];
    const uint32_t *outer = module->loop_end;

    module->fits &= can_unroll(module, header);
    for (uint32_t i = 0; vkb_fits(module); ++i) {
        if (i > 0)
            begin_block(module, header[1]);
        for (const uint32_t *at = start_iteration(module, header, i == 0); at < merge;
             at = vkb_next(at))
            vkb_copy_instruction(module, at);
        module->fits &= ids[branch[1]].value.known && i < MAX_ITERATIONS;
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
    if (!module->joined)
        VKB_WRITE(&module->function, SPV_BRANCH, vkb_go(module, merge[1]));
    return end;
}

static void write_range(struct vkb_unrolled *module, const uint32_t *at, const uint32_t *end)
{
    while (at < end && vkb_fits(module))
        if (vkb_opcode(at) == SPV_LABEL && !begin_block(module, at[1])) {
            while (!vkb_ends_block(at))
                at = vkb_next(at);
            at = vkb_next(at);
        } else if (vkb_opcode(at) == SPV_LABEL && module->ids[at[1]].merge)
            at = write_loop(module, at);
        else {
            if (vkb_opcode(at) != SPV_LABEL)
                vkb_copy_instruction(module, at);
            at = vkb_next(at);
        }
}

static void read_declarations(struct vkb_unrolled *module)
{
    const struct vkb_module *read = &module->read;

    for (const uint32_t *at = read->first; at < read->functions; at = vkb_next(at)) {
        struct value *value = &module->ids[vkb_result(at)].value;
        if (vkb_opcode(at) == SPV_DECORATE && at[1] < read->bound)
            module->ids[at[1]].decorated = true;
        value->known = vkb_constant(read, at, &value->number);
        if (!value->known)
            continue;
        module->fits &= module->constant_count < MAX_CONSTANTS;
        if (module->fits)
            module->constants[module->constant_count++] =
                (struct constant){at[1], value->number, at[2]};
    }
    module->declared_count = module->constant_count;
}

// Returns whether all code is in one function.
static bool read_function(struct vkb_unrolled *module)
{
    uint32_t label = 0, functions = 0, next;

    for (const uint32_t *at = module->read.functions; at < module->read.end; at = vkb_next(at)) {
        functions += vkb_opcode(at) == SPV_FUNCTION;
        if (vkb_opcode(at) == SPV_LABEL)
            label = at[1];
        else if (vkb_opcode(at) == SPV_LOOP_MERGE)
            module->ids[label].merge = at;
        else if (vkb_opcode(at) == SPV_SELECTION_MERGE)
            module->ids[at[1]].merges = true;
        for (uint32_t i = 0; (next = vkb_target(at, i)) != 0; ++i)
            if (next < module->read.bound && module->read.at[next] > at)
                ++module->ids[next].before;
    }
    return functions == 1;
}

// A decoration of each copy of what it decorates.
static void write_decoration(const struct vkb_unrolled *module, const uint32_t *at,
                             struct vkb_code *made)
{
    for (uint32_t i = module->ids[at[1]].copies; i; i = module->copies[i].before) {
        vkb_write(made, (uint32_t[]){at[0], module->copies[i].name}, 2);
        vkb_write(made, at + 2, vkb_word_count(at) - 2);
    }
}

static void write_declarations(const struct vkb_unrolled *module, struct vkb_code *made)
{
    const struct vkb_module *read = &module->read;

    for (const uint32_t *at = read->first; at < read->functions; at = vkb_next(at))
        if (vkb_opcode(at) == SPV_DECORATE && vkb_is_local(module, at[1]))
            write_decoration(module, at, made);
        else
            vkb_write(made, at, vkb_word_count(at));
    for (uint32_t i = module->declared_count; i < module->constant_count; ++i) {
        const struct constant *one = &module->constants[i];
        vkb_write_constant(made, read, one->type, one->name, one->number);
    }
}

static void write_function(struct vkb_unrolled *module)
{
    const uint32_t *first = vkb_next(module->read.functions), *end = first;

    module->fits &= vkb_opcode(first) == SPV_LABEL;
    if (!module->fits)
        return;
    vkb_write(&module->function, module->read.functions, vkb_word_count(module->read.functions));
    vkb_label_name(module, first[1]);
    while (vkb_opcode(end) != SPV_FUNCTION_END)
        end = vkb_next(end);
    write_range(module, first, end);
    vkb_write(&module->function, end, 1);
}

static bool has_loop(const uint32_t *at, const uint32_t *end)
{
    while (at < end && vkb_opcode(at) != SPV_LOOP_MERGE)
        at = vkb_next(at);
    return at < end;
}

static void destroy(struct vkb_unrolled *module)
{
    vkb_free(module->read.at);
    vkb_free(module->ids);
    vkb_free(module->blocks);
    vkb_free(module->copies);
    vkb_free(module->function.words);
    vkb_free(module);
}

static struct vkb_unrolled *create(const struct vkb_shader *shader, struct vkb_error *error)
{
    struct vkb_unrolled *module = vkb_alloc(error, 1, sizeof *module);
    size_t blocks = 0, copies = 0;

    if (!module)
        return NULL;
    // (vkb_alloc would write to all of what is grown here.)
    if (vkb_read_module(shader, &module->read, error)
        && (module->ids = vkb_alloc(error, module->read.bound, sizeof *module->ids)) != NULL
        && vkb_grow(error, &module->blocks, &blocks, MAX_IDS, sizeof *module->blocks)
        && vkb_grow(error, &module->copies, &copies, MAX_IDS, sizeof *module->copies)) {
        module->blocks[0] = (struct block){0};
        module->function.error = error;
        module->fits = module->read.bound < MAX_IDS;
        return module;
    }
    destroy(module);
    return NULL;
}

bool vkb_unroll(uint32_t **code, size_t *size, struct vkb_error *error)
{
    const struct vkb_shader shader = {.name = "a shader", .code = *code, .size = *size};
    struct vkb_code made = {.error = error};

    struct vkb_unrolled *module = create(&shader, error);
    if (!module)
        return false;
    module->fits &= has_loop(module->read.functions, module->read.end);
    read_declarations(module);
    module->fits &= read_function(module);
    // First, since it tells which declarations are needed.
    if (module->fits)
        write_function(module);
    if (vkb_fits(module)) {
        vkb_write(&made, *code, SPV_HEADER_WORDS);
        write_declarations(module, &made);
        vkb_write(&made, module->function.words, module->function.count);
    }
    const bool done = !module->function.failed && !made.failed;
    if (done && made.count > 0) {
        if (made.words[SPV_BOUND] <= module->last_name)
            made.words[SPV_BOUND] = module->last_name + 1;
        vkb_free(*code);
        *code = made.words;
        *size = made.count * sizeof *made.words;
    } else
        vkb_free(made.words);
    destroy(module);
    return done;
}
