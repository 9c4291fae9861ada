#include "execute/transient.h"

#include "transfer/sources.h"

// Frames of up to this share of the memory keep all images.
enum { KEPT_SHARE = 4 };

bool vkb_shares_memory(const struct vkb_device *device, const struct vkb_plan *plan,
                       uint32_t request_count)
{
    return request_count == 1 && device->memory_limit && !plan->graph.layers
        && plan->size > device->memory_limit / KEPT_SHARE;
}

void vkb_share_usages(struct vkb_run *run)
{
    const struct vkb_graph *graph = run->graph;

    for (uint32_t i = 0; i < graph->image_count; ++i)
        for (uint32_t other = 0; other < graph->image_count; ++other)
            if (!vkb_is_given(&graph->images[i]) && !vkb_is_given(&graph->images[other])
                && vkb_images_alike(&graph->images[i], &graph->images[other]))
                run->usages[i] |= graph->images[other].usage;
}

static bool has_memory(const struct vkb_run *run, uint32_t image)
{
    return run->images[image] && run->images[image]->image.handle;
}

bool vkb_begin_sharing(struct vkb_run *run, struct vkb_error *error)
{
    const struct vkb_graph *graph = run->graph;
    struct vkb_image_cache *cache = &run->frame->cache;

    vkb_spares_free(run->device, &cache->spares);
    // Images that do not fit are destroyed.
    if (!vkb_submissions_wait(run->device, &run->frame->submissions, error))
        return false;
    for (uint32_t i = 0; i < graph->image_count; ++i) {
        const struct vkb_image_row row = vkb_run_row(run, i);
        if (!run->frame->planner.wanted[i])
            continue;
        if (vkb_is_given(&row)) {
            if (!vkb_run_resolve(run, i, error))
                return false;
            continue;
        }
        struct vkb_cached_image *cached = vkb_image_cache_entry(run->device, cache, &row, error);
        if (!cached)
            return false;
        cached->used = cache->now;
        vkb_run_set_image(run, i, cached);
    }
    return true;
}

// An image that fits the row, and whose content no pass from `first` on reads; VKB_NO_IMAGE: none.
static uint32_t find_free(const struct vkb_run *run, const struct vkb_image_row *row,
                          uint32_t first)
{
    const struct vkb_graph *graph = run->graph;

    for (uint32_t i = 0; i < graph->image_count; ++i)
        if (!vkb_is_given(&graph->images[i]) && has_memory(run, i)
            && vkb_image_fits(&run->images[i]->image, row)
            && !vkb_planner_reads(&run->frame->planner, run->request->plan, i, first))
            return i;
    return VKB_NO_IMAGE;
}

bool vkb_share_targets(struct vkb_run *run, uint32_t first, struct vkb_error *error)
{
    uint32_t targets[VKB_MAX_TARGETS + 1];
    const uint32_t count = vkb_pass_targets(&run->graph->passes[first], targets);

    for (uint32_t i = 0; i < count; ++i) {
        const struct vkb_image_row row = vkb_run_row(run, targets[i]);
        if (has_memory(run, targets[i]))
            continue;
        const uint32_t from = find_free(run, &row, first);
        if (from != VKB_NO_IMAGE)
            vkb_image_cache_move(run->device, run->images[from], run->images[targets[i]]);
        else if (!vkb_image_cache_add(run->device, &run->frame->cache, &row, error))
            return false;
    }
    return true;
}
