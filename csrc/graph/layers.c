#include "graph/layers.h"

#include "graph/instructions.h"

#include <string.h>

enum {
    DIMENSION_2D = 1,         // of SPV_TYPE_IMAGE
    STORAGE_INPUT = 1,        // of SPV_TYPE_POINTER and SPV_VARIABLE
    BUILT_IN_WORKGROUP = 26,  // of SPV_BUILT_IN
};

// What the added instructions need, in an order in which it can be declared.
enum id { UINT, INT, FLOAT, UINT3, INT3, FLOAT3, POINTER, WORKGROUP, ID_COUNT };

struct words {
    uint32_t *words;
    size_t count, capacity;
};

struct module {
    const struct vkb_shader *shader;
    const uint32_t *first, *end;  // its instructions
    uint32_t bound;               // above all ids
    uint32_t *types;  // by id of a value: its type; by id of a vector: that of its components
    uint32_t ids[ID_COUNT];
    struct words missing;  // declarations
    bool has_workgroup;
    struct words made;
};

static bool emit(struct words *to, const uint32_t *words, size_t count, struct vkb_error *error)
{
    if (!vkb_grow(error, &to->words, &to->capacity, to->count + count, sizeof *to->words))
        return false;
    memcpy(to->words + to->count, words, count * sizeof *words);
    to->count += count;
    return true;
}

#define EMIT(to, op, ...) \
    emit(to, \
         (const uint32_t[]){ \
             (uint32_t)(op) | (uint32_t)(sizeof((const uint32_t[]){0, __VA_ARGS__}) / 4) << 16, \
             __VA_ARGS__}, \
         sizeof((const uint32_t[]){0, __VA_ARGS__}) / 4, error)

// Notes the type of each value, and the variable with the number of the workgroup.
static void read_types(struct module *module)
{
    for (const uint32_t *at = module->first; at < module->end; at = vkb_next(at)) {
        const uint32_t code = vkb_opcode(at);
        if (code == SPV_TYPE_VECTOR)
            module->types[at[1]] = at[2];
        else if (vkb_result(at) != 0 && vkb_result(at) == at[2])
            module->types[at[2]] = at[1];
        else if (code == SPV_DECORATE && at[2] == SPV_BUILT_IN && at[3] == BUILT_IN_WORKGROUP)
            module->ids[WORKGROUP] = at[1];
    }
    module->has_workgroup = module->ids[WORKGROUP] != 0;
}

// Finds the type with these operands, or declares it.
static bool declare(struct module *module, enum id id, uint32_t op, const uint32_t *operands,
                    size_t count, struct vkb_error *error)
{
    const uint32_t start[2] = {op | (uint32_t)(count + 2) << 16, module->bound};

    for (const uint32_t *at = module->first; at < module->end; at = vkb_next(at))
        if (at[0] == start[0] && memcmp(at + 2, operands, count * sizeof *operands) == 0) {
            module->ids[id] = at[1];
            return true;
        }
    module->ids[id] = module->bound++;
    return emit(&module->missing, start, 2, error)
        && emit(&module->missing, operands, count, error);
}

static bool declare_all(struct module *module, struct vkb_error *error)
{
    const uint32_t *ids = module->ids;
#define DECLARE(id, op, ...) \
    declare(module, id, op, (const uint32_t[]){__VA_ARGS__}, \
            sizeof((const uint32_t[]){__VA_ARGS__}) / 4, error)

    if (!DECLARE(UINT, SPV_TYPE_INT, 32, 0) || !DECLARE(INT, SPV_TYPE_INT, 32, 1)
        || !DECLARE(FLOAT, SPV_TYPE_FLOAT, 32) || !DECLARE(UINT3, SPV_TYPE_VECTOR, ids[UINT], 3)
        || !DECLARE(INT3, SPV_TYPE_VECTOR, ids[INT], 3)
        || !DECLARE(FLOAT3, SPV_TYPE_VECTOR, ids[FLOAT], 3)
        || !DECLARE(POINTER, SPV_TYPE_POINTER, STORAGE_INPUT, ids[UINT3]))
        return false;
#undef DECLARE
    if (module->has_workgroup)
        return true;
    module->ids[WORKGROUP] = module->bound++;
    return EMIT(&module->missing, SPV_VARIABLE, ids[POINTER], ids[WORKGROUP], STORAGE_INPUT);
}

// Adds the layer to the coordinates `*place` of two numbers.
static bool add_layer(struct module *module, uint32_t *place, struct vkb_error *error)
{
    const uint32_t *ids = module->ids, type = module->types[module->types[*place]];
    struct words *made = &module->made;
    const uint32_t loaded = module->bound++, layer = module->bound++, result = module->bound++;
    uint32_t number = layer, vector = ids[UINT3];

    if (type != ids[UINT] && type != ids[INT] && type != ids[FLOAT])
        return vkb_fail(error, VKB_ERROR_VALUE, "batch: the shader %s has no layers",
                        module->shader->name);
    if (!EMIT(made, SPV_LOAD, ids[UINT3], loaded, ids[WORKGROUP])
        || !EMIT(made, SPV_COMPOSITE_EXTRACT, ids[UINT], layer, loaded, 2))
        return false;
    if (type != ids[UINT]) {
        number = module->bound++;
        vector = type == ids[INT] ? ids[INT3] : ids[FLOAT3];
        if (!EMIT(made, type == ids[INT] ? SPV_BITCAST : SPV_CONVERT_U_TO_F, type, number, layer))
            return false;
    }
    if (!EMIT(made, SPV_COMPOSITE_CONSTRUCT, vector, result, *place, number))
        return false;
    *place = result;
    return true;
}

// The size of an image with layers has three numbers.
static bool query_size(struct module *module, uint32_t *words, struct vkb_error *error)
{
    const uint32_t type = words[1], result = words[2], size = module->bound++;

    words[1] = module->ids[module->types[type] == module->ids[INT] ? INT3 : UINT3];
    words[2] = size;
    return emit(&module->made, words, vkb_word_count(words), error)
        && EMIT(&module->made, SPV_VECTOR_SHUFFLE, type, result, size, size, 0, 1);
}

// Writes the instruction, and what an image with layers needs besides.
static bool rewrite(struct module *module, const uint32_t *given, struct vkb_error *error)
{
    enum { MOST = 64 };  // words of an instruction that is changed
    struct words *made = &module->made;
    const size_t size = vkb_word_count(given);
    const uint32_t op = vkb_opcode(given);
    uint32_t words[MOST + 1];

    if (op == SPV_FUNCTION) {
        if (!emit(made, module->missing.words, module->missing.count, error))
            return false;
        module->missing.count = 0;
    }
    if (op == SPV_DECORATE && !module->has_workgroup) {
        module->has_workgroup = true;
        if (!EMIT(made, SPV_DECORATE, module->ids[WORKGROUP], SPV_BUILT_IN, BUILT_IN_WORKGROUP))
            return false;
    }
    if (size > MOST)
        return emit(made, given, size, error);
    memcpy(words, given, size * sizeof *words);
    if (op == SPV_ENTRY_POINT && !module->has_workgroup) {
        words[0] += 1 << 16;
        words[size] = module->ids[WORKGROUP];
        return emit(made, words, size + 1, error);
    }
    if (op == SPV_TYPE_IMAGE)
        words[5] = 1;
    if (op == SPV_IMAGE_QUERY_SIZE || op == SPV_IMAGE_QUERY_SIZE_LOD)
        return query_size(module, words, error);
    const bool reads = op == SPV_SAMPLE_IMPLICIT || op == SPV_SAMPLE_EXPLICIT
                    || op == SPV_IMAGE_FETCH || op == SPV_IMAGE_GATHER || op == SPV_IMAGE_READ;
    if ((reads || op == SPV_IMAGE_WRITE) && !add_layer(module, &words[reads ? 4 : 2], error))
        return false;
    return emit(made, words, size, error);
}

static bool can_rewrite(const struct module *module)
{
    bool can = true;

    for (const uint32_t *at = module->first; at < module->end; at = vkb_next(at)) {
        const uint32_t code = vkb_opcode(at);
        if (code == SPV_TYPE_IMAGE)
            // Neither layers nor several samples.
            can = can && at[3] == DIMENSION_2D && at[5] == 0 && at[6] == 0;
        can = can && code != SPV_IMAGE_TEXEL_POINTER && code != SPV_IMAGE_DREF_GATHER
           && !(code > SPV_SAMPLE_EXPLICIT && code < SPV_IMAGE_FETCH);
    }
    return can;
}

static bool layer_code(struct module *module, struct vkb_error *error)
{
    if (!can_rewrite(module))
        return vkb_fail(error, VKB_ERROR_VALUE, "batch: the shader %s has other images",
                        module->shader->name);
    read_types(module);
    if (!declare_all(module, error)
        || !emit(&module->made, module->shader->code, SPV_HEADER_WORDS, error))
        return false;
    for (const uint32_t *at = module->first; at < module->end; at = vkb_next(at))
        if (!rewrite(module, at, error))
            return false;
    module->made.words[SPV_BOUND] = module->bound;
    return true;
}

bool vkb_layer_shader(const struct vkb_shader *shader, struct vkb_shader *made,
                      struct vkb_error *error)
{
    struct module module = {
        .shader = shader,
        .first = shader->code + SPV_HEADER_WORDS,
        .end = shader->code + shader->size / sizeof *shader->code,
        .bound = shader->code[SPV_BOUND],
    };

    module.types = vkb_alloc(error, module.bound, sizeof *module.types);
    const bool done = module.types && layer_code(&module, error);
    vkb_free(module.types);
    vkb_free(module.missing.words);
    if (!done) {
        vkb_free(module.made.words);
        return false;
    }
    *made = (struct vkb_shader){
        .name = shader->name,
        .code = module.made.words,
        .size = module.made.count * sizeof *module.made.words,
        .hash = shader->hash,
    };
    // No other shader's: that of the shader it is made from, inverted.
    for (size_t i = 0; i < sizeof made->hash.bytes; ++i)
        made->hash.bytes[i] ^= 0xff;
    return true;
}

static bool can_layer(const struct vkb_graph *graph)
{
    bool can = true;

    for (uint32_t i = 0; i < graph->image_count; ++i)
        can = can && !graph->images[i].serial && graph->images[i].input <= VKB_INPUT_IMAGE;
    for (uint32_t i = 0; i < graph->pass_count; ++i) {
        const struct vkb_pass_row *pass = &graph->passes[i];
        can = can && pass->geometry == VKB_GEOMETRY_DISPATCH && pass->reading != VKB_READING_WORDS
           && pass->resource_count == 0;
    }
    return can;
}

bool vkb_graph_layer(struct vkb_graph *graph, struct vkb_error *error)
{
    if (!can_layer(graph))
        return vkb_fail(error, VKB_ERROR_VALUE, "batch: its images have to be taken one by one");
    graph->layered = vkb_alloc(error, graph->pass_count, sizeof *graph->layered);
    if (!graph->layered)
        return false;
    for (uint32_t i = 0; i < graph->pass_count; ++i) {
        uint32_t at = 0;
        while (at < graph->layered_count && graph->layered[at].from != graph->passes[i].shader)
            ++at;
        struct vkb_layered *layered = &graph->layered[at];
        if (at == graph->layered_count) {
            if (!vkb_layer_shader(graph->passes[i].shader, &layered->shader, error))
                return false;
            layered->from = graph->passes[i].shader;
            ++graph->layered_count;
        }
        graph->passes[i].shader = &layered->shader;
    }
    for (uint32_t i = 0; i < graph->image_count; ++i)
        graph->images[i].layers = graph->layers;
    return true;
}
