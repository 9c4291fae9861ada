#include "graph/layers.h"

#include <string.h>

// Instructions of SPIR-V; see the specification, section 3.
enum op {
    OP_UNDEFINED = 1,
    OP_EXTENDED = 12,
    OP_ENTRY_POINT = 15,
    OP_TYPE_INT = 21,
    OP_TYPE_FLOAT = 22,
    OP_TYPE_VECTOR = 23,
    OP_TYPE_IMAGE = 25,
    OP_TYPE_POINTER = 32,
    OP_FIRST_CONSTANT = 41,
    OP_LAST_CONSTANT = 52,
    OP_FUNCTION = 54,
    OP_PARAMETER = 55,
    OP_CALL = 57,
    OP_VARIABLE = 59,
    OP_TEXEL_POINTER = 60,
    OP_LOAD = 61,
    OP_FIRST_ACCESS = 65,
    OP_LAST_ACCESS = 70,
    OP_DECORATE = 71,
    OP_SHUFFLE = 79,
    OP_CONSTRUCT = 80,
    OP_EXTRACT = 81,
    OP_FIRST_VECTOR = 77,
    OP_SAMPLE_IMPLICIT = 87,
    OP_SAMPLE_EXPLICIT = 88,
    OP_FETCH = 95,
    OP_GATHER = 96,
    OP_DREF_GATHER = 97,
    OP_READ = 98,
    OP_WRITE = 99,
    OP_IMAGE = 100,
    OP_QUERY_SIZE_LOD = 103,
    OP_QUERY_SIZE = 104,
    OP_UINT_TO_FLOAT = 112,
    OP_BITCAST = 124,
    OP_LAST_VALUE = 215,
    OP_PHI = 245,
};

enum {
    HEADER = 5,         // words before the first instruction
    BOUND = 3,          // the word of the header that is above all ids
    DIMENSION_2D = 1,   // of OP_TYPE_IMAGE
    STORAGE_INPUT = 1,  // of OP_TYPE_POINTER and OP_VARIABLE
    DECORATED_BUILT_IN = 11,
    BUILT_IN_WORKGROUP = 26,
};

// What the added instructions need, in an order in which it can be declared.
enum id { UINT, INT, FLOAT, UINT3, INT3, FLOAT3, POINTER, WORKGROUP, ID_COUNT };

struct words {
    uint32_t *words;
    size_t count, capacity;
};

struct module {
    const struct vkb_shader *shader;
    size_t count;     // its words
    uint32_t bound;   // above all ids
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

static enum op op_of(const uint32_t *words)
{
    return (enum op)(words[0] & 0xffff);
}

static size_t size_of(const uint32_t *words)
{
    return words[0] >> 16;
}

static bool has_value(enum op op)
{
    return op == OP_UNDEFINED || op == OP_EXTENDED || op == OP_PARAMETER || op == OP_CALL
        || op == OP_VARIABLE || op == OP_LOAD || op == OP_PHI
        || (op >= OP_FIRST_CONSTANT && op <= OP_LAST_CONSTANT)
        || (op >= OP_FIRST_ACCESS && op <= OP_LAST_ACCESS)
        || (op >= OP_FIRST_VECTOR && op <= OP_LAST_VALUE && op != OP_WRITE);
}

// Notes the type of each value, and the variable with the number of the workgroup.
static void read_types(struct module *module)
{
    const uint32_t *code = module->shader->code;

    for (size_t at = HEADER; at < module->count; at += size_of(code + at)) {
        const uint32_t *words = code + at;
        if (has_value(op_of(words)))
            module->types[words[2]] = words[1];
        else if (op_of(words) == OP_TYPE_VECTOR)
            module->types[words[1]] = words[2];
        else if (op_of(words) == OP_DECORATE && words[2] == DECORATED_BUILT_IN
                 && words[3] == BUILT_IN_WORKGROUP)
            module->ids[WORKGROUP] = words[1];
    }
    module->has_workgroup = module->ids[WORKGROUP] != 0;
}

// Finds the type with these operands, or declares it.
static bool declare(struct module *module, enum id id, enum op op, const uint32_t *operands,
                    size_t count, struct vkb_error *error)
{
    const uint32_t *code = module->shader->code;
    const uint32_t start[2] = {(uint32_t)op | (uint32_t)(count + 2) << 16, module->bound};

    for (size_t at = HEADER; at < module->count; at += size_of(code + at))
        if (code[at] == start[0]
            && memcmp(code + at + 2, operands, count * sizeof *operands) == 0) {
            module->ids[id] = code[at + 1];
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

    if (!DECLARE(UINT, OP_TYPE_INT, 32, 0) || !DECLARE(INT, OP_TYPE_INT, 32, 1)
        || !DECLARE(FLOAT, OP_TYPE_FLOAT, 32) || !DECLARE(UINT3, OP_TYPE_VECTOR, ids[UINT], 3)
        || !DECLARE(INT3, OP_TYPE_VECTOR, ids[INT], 3)
        || !DECLARE(FLOAT3, OP_TYPE_VECTOR, ids[FLOAT], 3)
        || !DECLARE(POINTER, OP_TYPE_POINTER, STORAGE_INPUT, ids[UINT3]))
        return false;
#undef DECLARE
    if (module->has_workgroup)
        return true;
    module->ids[WORKGROUP] = module->bound++;
    return EMIT(&module->missing, OP_VARIABLE, ids[POINTER], ids[WORKGROUP], STORAGE_INPUT);
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
    if (!EMIT(made, OP_LOAD, ids[UINT3], loaded, ids[WORKGROUP])
        || !EMIT(made, OP_EXTRACT, ids[UINT], layer, loaded, 2))
        return false;
    if (type != ids[UINT]) {
        number = module->bound++;
        vector = type == ids[INT] ? ids[INT3] : ids[FLOAT3];
        if (!EMIT(made, type == ids[INT] ? OP_BITCAST : OP_UINT_TO_FLOAT, type, number, layer))
            return false;
    }
    if (!EMIT(made, OP_CONSTRUCT, vector, result, *place, number))
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
    return emit(&module->made, words, size_of(words), error)
        && EMIT(&module->made, OP_SHUFFLE, type, result, size, size, 0, 1);
}

// Writes the instruction, and what an image with layers needs besides.
static bool rewrite(struct module *module, const uint32_t *given, struct vkb_error *error)
{
    enum { MOST = 64 };  // words of an instruction that is changed
    struct words *made = &module->made;
    const size_t size = size_of(given);
    const enum op op = op_of(given);
    uint32_t words[MOST + 1];

    if (op == OP_FUNCTION) {
        if (!emit(made, module->missing.words, module->missing.count, error))
            return false;
        module->missing.count = 0;
    }
    if (op == OP_DECORATE && !module->has_workgroup) {
        module->has_workgroup = true;
        if (!EMIT(made, OP_DECORATE, module->ids[WORKGROUP], DECORATED_BUILT_IN,
                  BUILT_IN_WORKGROUP))
            return false;
    }
    if (size > MOST)
        return emit(made, given, size, error);
    memcpy(words, given, size * sizeof *words);
    if (op == OP_ENTRY_POINT && !module->has_workgroup) {
        words[0] += 1 << 16;
        words[size] = module->ids[WORKGROUP];
        return emit(made, words, size + 1, error);
    }
    if (op == OP_TYPE_IMAGE)
        words[5] = 1;
    if (op == OP_QUERY_SIZE || op == OP_QUERY_SIZE_LOD)
        return query_size(module, words, error);
    const bool reads = op == OP_SAMPLE_IMPLICIT || op == OP_SAMPLE_EXPLICIT || op == OP_FETCH
                    || op == OP_GATHER || op == OP_READ;
    if ((reads || op == OP_WRITE) && !add_layer(module, &words[reads ? 4 : 2], error))
        return false;
    return emit(made, words, size, error);
}

static bool can_rewrite(const struct module *module)
{
    const uint32_t *code = module->shader->code;
    bool can = true;

    for (size_t at = HEADER; at < module->count; at += size_of(code + at)) {
        const uint32_t *words = code + at;
        const enum op op = op_of(words);
        if (op == OP_TYPE_IMAGE)
            // Neither layers nor several samples.
            can = can && words[3] == DIMENSION_2D && words[5] == 0 && words[6] == 0;
        can = can && op != OP_TEXEL_POINTER && op != OP_DREF_GATHER
           && !(op > OP_SAMPLE_EXPLICIT && op < OP_FETCH);
    }
    return can;
}

static bool layer_code(struct module *module, struct vkb_error *error)
{
    const uint32_t *code = module->shader->code;

    if (!can_rewrite(module))
        return vkb_fail(error, VKB_ERROR_VALUE, "batch: the shader %s has other images",
                        module->shader->name);
    read_types(module);
    if (!declare_all(module, error) || !emit(&module->made, code, HEADER, error))
        return false;
    for (size_t at = HEADER; at < module->count; at += size_of(code + at))
        if (!rewrite(module, code + at, error))
            return false;
    module->made.words[BOUND] = module->bound;
    return true;
}

static bool layer_shader(const struct vkb_shader *shader, struct vkb_shader *made,
                         struct vkb_error *error)
{
    struct module module = {
        .shader = shader,
        .count = shader->size / sizeof *shader->code,
        .bound = shader->code[BOUND],
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

bool vkb_graph_layer(struct vkb_graph *graph, uint32_t layers, struct vkb_error *error)
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
            if (!layer_shader(graph->passes[i].shader, &layered->shader, error))
                return false;
            layered->from = graph->passes[i].shader;
            ++graph->layered_count;
        }
        graph->passes[i].shader = &layered->shader;
    }
    for (uint32_t i = 0; i < graph->image_count; ++i)
        graph->images[i].layers = layers;
    graph->layers = layers;
    return true;
}
