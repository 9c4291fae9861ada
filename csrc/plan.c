#include "plan.h"

#include <string.h>

void vkb_plan_memory_destroy(struct vkb_plan_memory *memory)
{
    vkb_free(memory->request);
    *memory = (struct vkb_plan_memory){0};
}

static void mark_images(const struct vkb_pass_row *pass, bool *wanted)
{
    for (uint32_t read = 0; read < pass->read_count; ++read)
        wanted[pass->reads[read]] = true;
    for (uint32_t target = 0; target < pass->target_count; ++target)
        wanted[pass->targets[target]] = true;
    if (pass->depth != VKB_NO_IMAGE)
        wanted[pass->depth] = true;
}

static bool writes_wanted(const struct vkb_pass_row *pass, const bool *wanted)
{
    bool found = pass->depth != VKB_NO_IMAGE && wanted[pass->depth];

    for (uint32_t target = 0; target < pass->target_count; ++target)
        found = found || wanted[pass->targets[target]];
    return found;
}

// From the last pass to the first; `skipped` (VKB_NO_IMAGE: none) is left out, and of alternatives
// all but `chosen`.
static void mark(const struct vkb_graph *graph, const struct vkb_output *outputs,
                 uint32_t output_count, uint32_t skipped, uint32_t chosen, bool *needed,
                 bool *wanted)
{
    memset(needed, 0, graph->pass_count * sizeof *needed);
    memset(wanted, 0, graph->image_count * sizeof *wanted);
    for (uint32_t i = 0; i < output_count; ++i)
        wanted[outputs[i].image] = true;
    for (uint32_t i = graph->pass_count; i-- > 0;) {
        const struct vkb_pass_row *pass = &graph->passes[i];
        needed[i] =
            i != skipped && (!pass->alternative || i == chosen) && writes_wanted(pass, wanted);
        if (needed[i])
            mark_images(pass, wanted);
    }
}

static bool append(struct vkb_plan_memory *memory, const void *bytes, size_t size,
                   struct vkb_error *error)
{
    if (!vkb_grow(error, (void **)&memory->request, &memory->capacity, memory->size + size, 1))
        return false;
    memcpy(memory->request + memory->size, bytes, size);
    memory->size += size;
    return true;
}

static bool is_made_by(const struct vkb_graph *graph, const bool *passes, uint32_t image)
{
    for (uint32_t i = 0; i < graph->pass_count; ++i)
        if (passes[i] && graph->passes[i].targets[0] == image)
            return true;
    return false;
}

// What is asked for: the spared passes with the versions of the inputs that they read, then the
// pass itself. *from_input: they start from nothing else.
static bool write_request(const struct vkb_graph *graph, struct vkb_slot *const *slots,
                          const bool *spared, uint32_t original, struct vkb_plan_memory *request,
                          bool *from_input, struct vkb_error *error)
{
    *from_input = true;
    for (uint32_t i = 0; i < original; ++i) {
        const struct vkb_pass_row *pass = &graph->passes[i];
        if (!spared[i])
            continue;
        if (!append(request, pass, sizeof *pass, error))
            return false;
        for (uint32_t read = 0; read < pass->read_count; ++read) {
            const uint32_t image = pass->reads[read];
            const bool input = graph->images[image].input;
            *from_input = *from_input && (input || is_made_by(graph, spared, image));
            if (input
                && !append(request, &slots[image]->version, sizeof slots[image]->version, error))
                return false;
        }
    }
    request->spared_size = request->size;
    return append(request, &graph->passes[original], sizeof graph->passes[original], error);
}

// The passes that the alternative's image needs without it and not with it.
static bool find_spared(const struct vkb_graph *graph, uint32_t alternative, bool *spared,
                        struct vkb_error *error)
{
    const struct vkb_output output = {.image = graph->passes[alternative].targets[0]};
    bool *without = vkb_alloc(error, graph->pass_count, sizeof *without);
    bool *wanted = vkb_alloc(error, graph->image_count, sizeof *wanted);

    if (without && wanted) {
        mark(graph, &output, 1, alternative, VKB_NO_IMAGE, without, wanted);
        mark(graph, &output, 1, alternative - 1, alternative, spared, wanted);
        for (uint32_t i = 0; i < graph->pass_count; ++i)
            spared[i] = without[i] && !spared[i] && i != alternative - 1;
    }
    const bool done = without && wanted;
    vkb_free(without);
    vkb_free(wanted);
    return done;
}

// Whether the alternative should run, by what was asked for the last time; `useful`: it would spare
// a pass now.
static bool choose(const struct vkb_graph *graph, struct vkb_slot *const *slots, const bool *spared,
                   uint32_t original, bool useful, struct vkb_plan_memory *memory, bool *chosen,
                   struct vkb_error *error)
{
    struct vkb_plan_memory now = {0};
    bool from_input;

    if (!write_request(graph, slots, spared, original, &now, &from_input, error)) {
        vkb_plan_memory_destroy(&now);
        return false;
    }
    const bool same_spared = from_input && now.spared_size == memory->spared_size
                          && memcmp(now.request, memory->request, now.spared_size) == 0;
    const bool same = same_spared && now.size == memory->size
                   && memcmp(now.request, memory->request, now.size) == 0;
    now.alternative = useful && (same ? memory->alternative : !same_spared);
    vkb_plan_memory_destroy(memory);
    *memory = now;
    *chosen = now.alternative;
    return true;
}

bool vkb_plan(const struct vkb_graph *graph, struct vkb_slot *const *slots,
              const struct vkb_output *outputs, uint32_t output_count,
              struct vkb_plan_memory *memory, bool *needed, bool *wanted, struct vkb_error *error)
{
    bool useful = false, chosen = false;
    uint32_t index = 0;

    while (index < graph->pass_count && !graph->passes[index].alternative)
        ++index;
    mark(graph, outputs, output_count, VKB_NO_IMAGE, VKB_NO_IMAGE, needed, wanted);
    if (index == graph->pass_count || !needed[index - 1])
        return true;
    bool *spared = vkb_alloc(error, graph->pass_count, sizeof *spared);
    bool done = spared && find_spared(graph, index, spared, error);
    if (done) {
        mark(graph, outputs, output_count, index - 1, index, needed, wanted);
        for (uint32_t i = 0; i < graph->pass_count; ++i)
            useful = useful || (spared[i] && !needed[i]);
        done = choose(graph, slots, spared, index - 1, useful, memory, &chosen, error);
    }
    if (done && !chosen)
        mark(graph, outputs, output_count, index, VKB_NO_IMAGE, needed, wanted);
    vkb_free(spared);
    return done;
}
