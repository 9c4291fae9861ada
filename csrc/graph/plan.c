#include "graph/plan.h"

#include <string.h>

void vkb_plan_destroy(struct vkb_plan *plan)
{
    vkb_graph_destroy(&plan->graph);
    vkb_free(plan->outputs);
    *plan = (struct vkb_plan){0};
}

void vkb_planner_destroy(struct vkb_planner *planner)
{
    vkb_free(planner->current);
    vkb_free(planner->needed);
    vkb_free(planner->wanted);
    vkb_free(planner->recipe);
    vkb_free(planner->previous);
    *planner = (struct vkb_planner){0};
}

bool vkb_content_begin_writing(struct vkb_content *content, uint64_t *clock, const void *recipe,
                               size_t size, struct vkb_error *error)
{
    content->valid = false;
    content->version = ++*clock;
    content->repeated =
        size > 0 && content->recipe_size == size && memcmp(content->recipe, recipe, size) == 0;
    if (!vkb_grow(error, &content->recipe, &content->recipe_capacity, size, 1))
        return false;
    if (size)
        memcpy(content->recipe, recipe, size);
    content->recipe_size = size;
    return true;
}

static bool append(struct vkb_planner *planner, const void *bytes, size_t size,
                   struct vkb_error *error)
{
    if (!vkb_grow(error, &planner->recipe, &planner->recipe_capacity, planner->recipe_size + size,
                  1))
        return false;
    memcpy(planner->recipe + planner->recipe_size, bytes, size);
    planner->recipe_size += size;
    return true;
}

// Writes the recipe of the targets of passes first..end-1: the rows of these passes, with the
// versions of the images that they read instead of the indices in the graph. What a pass reads in
// place has none.
static bool write_recipe(struct vkb_planner *planner, const struct vkb_plan_step *step,
                         uint32_t first, uint32_t end, struct vkb_error *error)
{
    planner->recipe_size = 0;
    for (uint32_t i = first; i < end; ++i) {
        struct vkb_pass_row row = step->plan->graph.passes[i];
        unsigned char bytes[sizeof row];
        uint64_t versions[VKB_MAX_READS + 1] = {0};

        for (uint32_t read = 0; read < row.read_count; ++read)
            if (vkb_pass_needs(&row, read))
                versions[read] = step->contents[row.reads[read]]->version;
        if (row.geometry != VKB_GEOMETRY_FULLSCREEN && row.geometry != VKB_GEOMETRY_DISPATCH)
            versions[VKB_MAX_READS] = step->scene;
        memset(row.reads, 0, sizeof row.reads);
        memset(row.targets, 0, sizeof row.targets);
        row.depth = row.depth != VKB_NO_IMAGE;
        if (!append(planner, bytes, vkb_pass_pack(&row, bytes), error)
            || !append(planner, versions, sizeof versions, error))
            return false;
    }
    return true;
}

// Whether the image exists and holds the result of a current pass before `end`, or is given.
static bool is_current(const struct vkb_planner *planner, const struct vkb_plan_step *step,
                       uint32_t image, uint32_t end)
{
    const struct vkb_graph *graph = &step->plan->graph;
    bool current = vkb_is_given(&graph->images[image]);

    for (uint32_t i = 0; i < end; ++i)
        current = current || (planner->current[i] && vkb_pass_writes(&graph->passes[i], image));
    return current && step->contents[image];
}

bool vkb_content_holds(const struct vkb_content *content, const void *recipe, size_t size)
{
    return content && content->valid && content->recipe_size == size
        && (size == 0 || memcmp(content->recipe, recipe, size) == 0);
}

// Sets *same if the targets of passes first..end-1 already hold the result of these passes. The
// recipe stays in planner->recipe.
static bool compare_recipe(struct vkb_planner *planner, const struct vkb_plan_step *step,
                           uint32_t first, uint32_t end, bool *same, struct vkb_error *error)
{
    uint32_t targets[VKB_MAX_TARGETS + 1];
    const uint32_t count = vkb_pass_targets(&step->plan->graph.passes[first], targets);

    if (!write_recipe(planner, step, first, end, error))
        return false;
    *same = true;
    for (uint32_t i = 0; i < count; ++i)
        *same =
            *same
            && vkb_content_holds(step->contents[targets[i]], planner->recipe, planner->recipe_size);
    return true;
}

// Marks the passes that are up to date, from the first to the last: their targets were made from
// the same recipe, and the images that they read are up to date too.
static bool mark_current(struct vkb_planner *planner, const struct vkb_plan_step *step,
                         struct vkb_error *error)
{
    const struct vkb_graph *graph = &step->plan->graph;

    memset(planner->current, 0, graph->pass_count * sizeof *planner->current);
    for (uint32_t first = 0, end; first < graph->pass_count; first = end) {
        bool found = true;

        end = vkb_graph_group_end(graph, first);
        for (uint32_t i = first; i < end; ++i)
            for (uint32_t read = 0; read < graph->passes[i].read_count; ++read)
                found = found
                     && (!vkb_pass_needs(&graph->passes[i], read)
                         || is_current(planner, step, graph->passes[i].reads[read], first));
        if (found && !compare_recipe(planner, step, first, end, &found, error))
            return false;
        for (uint32_t i = first; i < end; ++i)
            planner->current[i] = found;
    }
    return true;
}

static void mark_images(const struct vkb_pass_row *pass, bool *wanted)
{
    for (uint32_t read = 0; read < pass->read_count; ++read)
        if (pass->reads[read] != VKB_NO_IMAGE)
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

// Marks needed passes and wanted images, from the last pass to the first. `skipped` passes are
// replaced by fused passes, or are fused passes that are not selected.
static void mark(const struct vkb_plan *plan, const bool *skipped, bool *needed, bool *wanted)
{
    const struct vkb_graph *graph = &plan->graph;

    memset(needed, 0, graph->pass_count * sizeof *needed);
    memset(wanted, 0, graph->image_count * sizeof *wanted);
    for (uint32_t i = 0; i < plan->output_count; ++i)
        wanted[plan->outputs[i]] = true;
    // Whatever framebuffers are requested, the call makes the history of the next one.
    for (uint32_t i = 0; i < graph->image_count; ++i)
        if (vkb_is_history(&graph->images[i]))
            wanted[graph->images[i].history_of] = true;
    for (uint32_t i = graph->pass_count; i-- > 0;) {
        // A pass with a turn may write what no image shows.
        needed[i] =
            !skipped[i] && (graph->passes[i].turn || writes_wanted(&graph->passes[i], wanted));
        if (needed[i])
            mark_images(&graph->passes[i], wanted);
    }
}

// `current` may be NULL: no pass is.
static bool is_read_later(const struct vkb_plan *plan, const bool *needed, const bool *current,
                          uint32_t image, uint32_t first)
{
    const struct vkb_graph *graph = &plan->graph;

    for (uint32_t i = first; i < graph->pass_count; ++i) {
        if (!needed[i] || (current && current[i]))
            continue;
        // What pass `first` is about to write must not become the memory of another target of it.
        if (vkb_pass_writes(&graph->passes[i], image))
            return i == first;
        if (vkb_pass_reads(&graph->passes[i], image))
            return true;
    }
    for (uint32_t i = 0; i < plan->output_count; ++i)
        if (plan->outputs[i] == image)
            return true;
    return vkb_graph_history(graph, image) != VKB_NO_IMAGE;
}

bool vkb_planner_reads(const struct vkb_planner *planner, const struct vkb_plan *plan,
                       uint32_t image, uint32_t first)
{
    return is_read_later(plan, planner->needed, planner->current, image, first);
}

// What a plan needs: passes, and images; which passes are skipped, and which images have memory.
struct needs {
    bool *skipped, *needed, *wanted, *held;
};

static bool find_needs(const struct vkb_plan *plan, struct needs *needs, struct vkb_error *error)
{
    const size_t passes = plan->graph.pass_count, images = plan->graph.image_count;
    bool *marks = vkb_alloc(error, 2 * (passes + images), sizeof *marks);

    if (!marks)
        return false;
    *needs = (struct needs){marks, marks + passes, marks + 2 * passes, marks + 2 * passes + images};
    mark(plan, needs->skipped, needs->needed, needs->wanted);
    return true;
}

bool vkb_plan_measure(struct vkb_plan *plan, struct vkb_error *error)
{
    struct needs needs;

    if (!find_needs(plan, &needs, error))
        return false;
    plan->size = 0;
    for (uint32_t i = 0; i < plan->graph.image_count; ++i)
        plan->size += needs.wanted[i] ? vkb_image_size(&plan->graph.images[i]) : 0;
    vkb_free(needs.skipped);
    return true;
}

// Gives the target of pass `first` memory: that of an image which is not read any more, or new one.
// Returns the bytes of new memory.
static uint64_t hold_target(const struct vkb_plan *plan, const struct needs *needs, uint32_t first,
                            uint32_t target)
{
    const struct vkb_graph *graph = &plan->graph;
    const struct vkb_image_row *row = &graph->images[target];

    if (needs->held[target])
        return 0;
    needs->held[target] = true;
    for (uint32_t i = 0; i < graph->image_count; ++i)
        if (i != target && needs->held[i] && !vkb_is_given(&graph->images[i])
            && vkb_images_alike(&graph->images[i], row)
            && !is_read_later(plan, needs->needed, NULL, i, first)) {
            needs->held[i] = false;
            return 0;
        }
    return vkb_image_size(row);
}

bool vkb_plan_shared_size(const struct vkb_plan *plan, uint64_t *size, struct vkb_error *error)
{
    const struct vkb_graph *graph = &plan->graph;
    struct needs needs;

    if (!find_needs(plan, &needs, error))
        return false;
    *size = 0;
    for (uint32_t i = 0; i < graph->image_count; ++i) {
        needs.held[i] = needs.wanted[i] && vkb_is_given(&graph->images[i]);
        *size += needs.held[i] ? vkb_image_size(&graph->images[i]) : 0;
    }
    for (uint32_t i = 0; i < graph->pass_count; ++i) {
        uint32_t targets[VKB_MAX_TARGETS + 1];
        const uint32_t count = needs.needed[i] ? vkb_pass_targets(&graph->passes[i], targets) : 0;
        for (uint32_t target = 0; target < count; ++target)
            *size += hold_target(plan, &needs, i, targets[target]);
    }
    vkb_free(needs.skipped);
    return true;
}

static uint32_t count_running(const struct vkb_graph *graph, const bool *needed,
                              const bool *current)
{
    uint32_t count = 0;

    for (uint32_t i = 0; i < graph->pass_count; ++i)
        count += needed[i] && !current[i];
    return count;
}

// The plan before or after: its passes, packed or not.
struct neighbour {
    const struct vkb_packed_pass *packed;
    const struct vkb_pass_row *rows;
    size_t count;
};

static void pack(const struct vkb_pass_row *row, struct vkb_packed_pass *packed)
{
    packed->size = vkb_pass_pack(row, packed->bytes);
}

static bool same_pass(const struct vkb_graph *graph, const struct neighbour *neighbour, uint32_t i)
{
    struct vkb_packed_pass first, second;
    const struct vkb_packed_pass *other = neighbour->packed ? &neighbour->packed[i] : &second;

    if (i >= graph->pass_count || i >= neighbour->count)
        return false;
    pack(&graph->passes[i], &first);
    if (neighbour->rows)
        pack(&neighbour->rows[i], &second);
    return first.size == other->size && memcmp(first.bytes, other->bytes, first.size) == 0;
}

// Whether the plan before or after has the same passes as those that a fused group saves, except
// the group that it replaces, from `replaced` to before `fused`. Then running them once serves both
// plans.
static bool shares(const struct vkb_graph *graph, const struct neighbour *neighbour,
                   uint32_t replaced, uint32_t fused, const bool *plain, const bool *needed,
                   const bool *current)
{
    bool same = true;

    for (uint32_t i = replaced; i < fused; ++i)
        same = same && same_pass(graph, neighbour, i);
    if (!neighbour->count || same)
        return false;
    for (uint32_t i = 0; i < graph->pass_count; ++i)
        if (plain[i] && !needed[i] && !current[i] && (i < replaced || i >= fused)
            && !same_pass(graph, neighbour, i))
            return false;
    return true;
}

// Skips the passes of a fused group, or those of the group that it replaces.
static void skip(uint32_t replaced, uint32_t fused, uint32_t end, bool skips_fused, bool *skipped)
{
    for (uint32_t i = replaced; i < end; ++i)
        skipped[i] = (i >= fused) == skips_fused;
}

// Selects each fused group that reduces the number of passes to run.
static bool mark_needed(struct vkb_planner *planner, const struct vkb_plan_step *step,
                        struct vkb_error *error)
{
    const struct vkb_graph *graph = &step->plan->graph;
    const bool follows = step->source == planner->previous_source;
    const struct neighbour previous = {planner->previous, NULL,
                                       follows ? planner->previous_count : 0};
    const struct neighbour next = {NULL, step->next ? step->next->passes : NULL,
                                   step->next ? step->next->pass_count : 0};
    bool *needed = planner->needed, *wanted = planner->wanted;
    const bool *current = planner->current;
    bool *skipped = vkb_alloc(error, (size_t)2 * graph->pass_count, sizeof *skipped);

    if (!skipped)
        return false;
    bool *plain = skipped + graph->pass_count;
    for (uint32_t i = 0; i < graph->pass_count; ++i)
        skipped[i] = graph->passes[i].fused;
    mark(step->plan, skipped, needed, wanted);
    for (uint32_t before = 0, first = 0, end; first < graph->pass_count;
         before = first, first = end) {
        end = vkb_graph_group_end(graph, first);
        if (!graph->passes[first].fused || step->unfused)
            continue;
        memcpy(plain, needed, graph->pass_count * sizeof *plain);
        skip(before, first, end, false, skipped);
        mark(step->plan, skipped, needed, wanted);
        if (count_running(graph, needed, current) < count_running(graph, plain, current)
            && !shares(graph, &previous, before, first, plain, needed, current)
            && !shares(graph, &next, before, first, plain, needed, current))
            continue;
        skip(before, first, end, true, skipped);
        mark(step->plan, skipped, needed, wanted);
    }
    vkb_free(skipped);
    return true;
}

// Packs the plan's passes: the plan may be destroyed before the next one arrives.
static bool keep_previous(struct vkb_planner *planner, const struct vkb_plan_step *step,
                          struct vkb_error *error)
{
    const struct vkb_graph *graph = &step->plan->graph;

    planner->previous_count = 0;
    if (!vkb_grow(error, &planner->previous, &planner->previous_capacity, graph->pass_count,
                  sizeof *planner->previous))
        return false;
    while (planner->previous_count < graph->pass_count) {
        pack(&graph->passes[planner->previous_count], &planner->previous[planner->previous_count]);
        ++planner->previous_count;
    }
    planner->previous_source = step->source;
    return true;
}

bool vkb_planner_mark(struct vkb_planner *planner, const struct vkb_plan_step *step,
                      struct vkb_error *error)
{
    const struct vkb_graph *graph = &step->plan->graph;

    return vkb_grow(error, &planner->current, &planner->current_capacity, graph->pass_count,
                    sizeof *planner->current)
        && vkb_grow(error, &planner->needed, &planner->needed_capacity, graph->pass_count,
                    sizeof *planner->needed)
        && vkb_grow(error, &planner->wanted, &planner->wanted_capacity, graph->image_count,
                    sizeof *planner->wanted)
        && mark_current(planner, step, error) && mark_needed(planner, step, error)
        && keep_previous(planner, step, error);
}

bool vkb_planner_run(struct vkb_planner *planner, const struct vkb_plan_step *step, uint64_t *clock,
                     vkb_record *record, void *context, struct vkb_error *error)
{
    const struct vkb_graph *graph = &step->plan->graph;

    for (uint32_t first = 0, end; first < graph->pass_count; first = end) {
        uint32_t targets[VKB_MAX_TARGETS + 1];
        const uint32_t target_count = vkb_pass_targets(&graph->passes[first], targets);
        bool same;

        end = vkb_graph_group_end(graph, first);
        // All passes of a group are needed if one is: they share their targets.
        if (!planner->needed[first])
            continue;
        if (!compare_recipe(planner, step, first, end, &same, error))
            return false;
        if (same)
            continue;
        for (uint32_t i = 0; i < target_count; ++i)
            if (!vkb_content_begin_writing(step->contents[targets[i]], clock, planner->recipe,
                                           planner->recipe_size, error))
                return false;
        if (!record(context, first, end, error))
            return false;
        for (uint32_t i = 0; i < target_count; ++i)
            step->contents[targets[i]]->valid = true;
    }
    return true;
}
