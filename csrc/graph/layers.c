#include "graph/layers.h"

#include "graph/module.h"

#include <string.h>

enum {
    DIMENSION_2D = 1,         // of SPV_TYPE_IMAGE
    STORAGE_INPUT = 1,        // of SPV_TYPE_POINTER and SPV_VARIABLE
    BUILT_IN_WORKGROUP = 26,  // of SPV_BUILT_IN
};

// What the added instructions need, in an order in which it can be declared.
enum id { UINT, INT, FLOAT, UINT3, INT3, FLOAT3, POINTER, WORKGROUP, ID_COUNT };

struct module {
    const struct vkb_shader *shader;
    struct vkb_module read;
    uint32_t bound;  // above all ids, also the added ones
    uint32_t ids[ID_COUNT];
    struct vkb_code missing;  // declarations
    bool has_workgroup;
    struct vkb_code made;
};

// Finds the type with these operands, or declares it.
static void declare(struct module *module, enum id id, uint32_t op, const uint32_t *operands,
                    uint32_t count)
{
    const uint32_t start[2] = {op | (count + 2) << 16, module->bound};

    for (const uint32_t *at = module->read.first; at < module->read.end; at = vkb_next(at))
        if (at[0] == start[0] && memcmp(at + 2, operands, count * sizeof *operands) == 0) {
            module->ids[id] = at[1];
            return;
        }
    module->ids[id] = module->bound++;
    vkb_write(&module->missing, start, 2);
    vkb_write(&module->missing, operands, count);
}

static void declare_all(struct module *module)
{
    const uint32_t *ids = module->ids;
#define DECLARE(id, op, ...) \
    declare(module, id, op, (const uint32_t[]){__VA_ARGS__}, VKB_WORDS(__VA_ARGS__))

    DECLARE(UINT, SPV_TYPE_INT, 32, 0);
    DECLARE(INT, SPV_TYPE_INT, 32, 1);
    DECLARE(FLOAT, SPV_TYPE_FLOAT, 32);
    DECLARE(UINT3, SPV_TYPE_VECTOR, ids[UINT], 3);
    DECLARE(INT3, SPV_TYPE_VECTOR, ids[INT], 3);
    DECLARE(FLOAT3, SPV_TYPE_VECTOR, ids[FLOAT], 3);
    DECLARE(POINTER, SPV_TYPE_POINTER, STORAGE_INPUT, ids[UINT3]);
#undef DECLARE
    if (module->has_workgroup)
        return;
    module->ids[WORKGROUP] = module->bound++;
    VKB_WRITE(&module->missing, SPV_VARIABLE, ids[POINTER], ids[WORKGROUP], STORAGE_INPUT);
}

// Adds the layer to the coordinates `*place` of two numbers.
static bool add_layer(struct module *module, uint32_t *place, struct vkb_error *error)
{
    const uint32_t *vector_type = vkb_type_of(&module->read, *place, SPV_TYPE_VECTOR);
    const uint32_t *ids = module->ids, type = vector_type ? vector_type[2] : 0;
    struct vkb_code *made = &module->made;
    const uint32_t loaded = module->bound++, layer = module->bound++, result = module->bound++;
    uint32_t number = layer, vector = ids[UINT3];

    if (type != ids[UINT] && type != ids[INT] && type != ids[FLOAT])
        return vkb_fail(error, VKB_ERROR_VALUE, "batch: the shader %s has no layers",
                        module->shader->name);
    VKB_WRITE(made, SPV_LOAD, ids[UINT3], loaded, ids[WORKGROUP]);
    VKB_WRITE(made, SPV_COMPOSITE_EXTRACT, ids[UINT], layer, loaded, 2);
    if (type != ids[UINT]) {
        number = module->bound++;
        vector = type == ids[INT] ? ids[INT3] : ids[FLOAT3];
        VKB_WRITE(made, type == ids[INT] ? SPV_BITCAST : SPV_CONVERT_U_TO_F, type, number, layer);
    }
    VKB_WRITE(made, SPV_COMPOSITE_CONSTRUCT, vector, result, *place, number);
    *place = result;
    return true;
}

// The size of an image with layers has three numbers.
static void query_size(struct module *module, uint32_t *words)
{
    const uint32_t type = words[1], result = words[2], size = module->bound++;
    const uint32_t *vector = vkb_type_of(&module->read, result, SPV_TYPE_VECTOR);

    words[1] = module->ids[vector && vector[2] == module->ids[INT] ? INT3 : UINT3];
    words[2] = size;
    vkb_write(&module->made, words, vkb_word_count(words));
    VKB_WRITE(&module->made, SPV_VECTOR_SHUFFLE, type, result, size, size, 0, 1);
}

// Writes the instruction, and what an image with layers needs besides.
static bool rewrite(struct module *module, const uint32_t *given, struct vkb_error *error)
{
    enum { MOST = 64 };  // words of an instruction that is changed
    struct vkb_code *made = &module->made;
    const size_t size = vkb_word_count(given);
    const uint32_t op = vkb_opcode(given);
    uint32_t words[MOST + 1];

    if (op == SPV_FUNCTION) {
        vkb_write(made, module->missing.words, module->missing.count);
        module->missing.count = 0;
    }
    if (op == SPV_DECORATE && !module->has_workgroup) {
        module->has_workgroup = true;
        VKB_WRITE(made, SPV_DECORATE, module->ids[WORKGROUP], SPV_BUILT_IN, BUILT_IN_WORKGROUP);
    }
    if (size > MOST) {
        vkb_write(made, given, size);
        return true;
    }
    memcpy(words, given, size * sizeof *words);
    if (op == SPV_ENTRY_POINT && !module->has_workgroup) {
        words[0] += 1 << 16;
        words[size] = module->ids[WORKGROUP];
    }
    if (op == SPV_TYPE_IMAGE)
        words[5] = 1;
    if (op == SPV_IMAGE_QUERY_SIZE || op == SPV_IMAGE_QUERY_SIZE_LOD) {
        query_size(module, words);
        return true;
    }
    const bool reads = op == SPV_SAMPLE_IMPLICIT || op == SPV_SAMPLE_EXPLICIT
                    || op == SPV_IMAGE_FETCH || op == SPV_IMAGE_GATHER || op == SPV_IMAGE_READ;
    if ((reads || op == SPV_IMAGE_WRITE) && !add_layer(module, &words[reads ? 4 : 2], error))
        return false;
    vkb_write(made, words, vkb_word_count(words));
    return true;
}

// Also finds the variable with the number of the workgroup.
static bool can_rewrite(struct module *module)
{
    bool can = true;

    for (const uint32_t *at = module->read.first; at < module->read.end; at = vkb_next(at)) {
        const uint32_t code = vkb_opcode(at);
        if (code == SPV_TYPE_IMAGE)
            // Neither layers nor several samples.
            can = can && at[3] == DIMENSION_2D && at[5] == 0 && at[6] == 0;
        can = can && code != SPV_IMAGE_TEXEL_POINTER && code != SPV_IMAGE_DREF_GATHER
           && !(code > SPV_SAMPLE_EXPLICIT && code < SPV_IMAGE_FETCH);
        if (code == SPV_DECORATE && at[2] == SPV_BUILT_IN && at[3] == BUILT_IN_WORKGROUP)
            module->ids[WORKGROUP] = at[1];
    }
    module->has_workgroup = module->ids[WORKGROUP] != 0;
    return can;
}

static bool layer_code(struct module *module, struct vkb_error *error)
{
    if (!vkb_read_module(module->shader, &module->read, error))
        return false;
    if (!can_rewrite(module))
        return vkb_fail(error, VKB_ERROR_VALUE, "batch: the shader %s has other images",
                        module->shader->name);
    module->bound = module->read.bound;
    declare_all(module);
    vkb_write(&module->made, module->shader->code, SPV_HEADER_WORDS);
    for (const uint32_t *at = module->read.first; at < module->read.end; at = vkb_next(at))
        if (!rewrite(module, at, error))
            return false;
    if (module->missing.failed || module->made.failed)
        return false;
    module->made.words[SPV_BOUND] = module->bound;
    return true;
}

bool vkb_layer_shader(const struct vkb_shader *shader, struct vkb_shader *made,
                      struct vkb_error *error)
{
    struct module module = {.shader = shader, .missing.error = error, .made.error = error};
    const bool done = layer_code(&module, error);

    vkb_free(module.read.at);
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
