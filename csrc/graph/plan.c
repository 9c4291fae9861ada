#include "graph/plan.h"

#include <string.h>

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

// From the last pass to the first; `skipped` are the passes that others stand for.
static void mark(const struct vkb_graph *graph, const struct vkb_output *outputs,
                 uint32_t output_count, const bool *skipped, bool *needed, bool *wanted)
{
    memset(needed, 0, graph->pass_count * sizeof *needed);
    memset(wanted, 0, graph->image_count * sizeof *wanted);
    for (uint32_t i = 0; i < output_count; ++i)
        wanted[outputs[i].image] = true;
    for (uint32_t i = graph->pass_count; i-- > 0;) {
        needed[i] = !skipped[i] && writes_wanted(&graph->passes[i], wanted);
        if (needed[i])
            mark_images(&graph->passes[i], wanted);
    }
}

static uint32_t count_running(const struct vkb_graph *graph, const bool *needed,
                              const bool *current)
{
    uint32_t count = 0;

    for (uint32_t i = 0; i < graph->pass_count; ++i)
        count += needed[i] && !current[i];
    return count;
}

static bool same_pass(const struct vkb_graph *a, const struct vkb_graph *b, uint32_t i)
{
    unsigned char first[sizeof(struct vkb_pass_row)], second[sizeof first];

    if (i >= a->pass_count || i >= b->pass_count)
        return false;
    const size_t size = vkb_pass_pack(&a->passes[i], first);
    return size == vkb_pass_pack(&b->passes[i], second) && memcmp(first, second, size) == 0;
}

// Whether the neighbour has what the alternative spares, the same, but not the pass before it,
// which reads that.
static bool shares(const struct vkb_graph *graph, const struct vkb_graph *neighbour,
                   uint32_t alternative, const bool *plain, const bool *needed, const bool *current)
{
    if (!neighbour || same_pass(graph, neighbour, alternative - 1))
        return false;
    for (uint32_t i = 0; i < graph->pass_count; ++i)
        if (plain[i] && !needed[i] && !current[i] && i != alternative - 1
            && !same_pass(graph, neighbour, i))
            return false;
    return true;
}

bool vkb_plan(const struct vkb_graph *graph, const struct vkb_neighbours *neighbours,
              const struct vkb_output *outputs, uint32_t output_count, const bool *current,
              bool *needed, bool *wanted, struct vkb_error *error)
{
    bool *skipped = vkb_alloc(error, (size_t)2 * graph->pass_count, sizeof *skipped);

    if (!skipped)
        return false;
    bool *plain = skipped + graph->pass_count;
    for (uint32_t i = 0; i < graph->pass_count; ++i)
        skipped[i] = graph->passes[i].alternative;
    mark(graph, outputs, output_count, skipped, needed, wanted);
    for (uint32_t i = 0; i < graph->pass_count; ++i) {
        if (!graph->passes[i].alternative)
            continue;
        memcpy(plain, needed, graph->pass_count * sizeof *plain);
        skipped[i] = false;
        skipped[i - 1] = true;
        mark(graph, outputs, output_count, skipped, needed, wanted);
        if (count_running(graph, needed, current) < count_running(graph, plain, current)
            && !shares(graph, neighbours->previous, i, plain, needed, current)
            && !shares(graph, neighbours->next, i, plain, needed, current))
            continue;
        skipped[i] = true;
        skipped[i - 1] = false;
        mark(graph, outputs, output_count, skipped, needed, wanted);
    }
    vkb_free(skipped);
    return true;
}
