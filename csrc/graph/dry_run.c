#include "graph/dry_run.h"

#include <string.h>

void vkb_dry_run_destroy(struct vkb_dry_run *dry_run)
{
    for (size_t i = 0; i < dry_run->count; ++i) {
        vkb_free(dry_run->images[i]->content.recipe);
        vkb_free(dry_run->images[i]);
    }
    vkb_free(dry_run->images);
    vkb_planner_destroy(&dry_run->planner);
    *dry_run = (struct vkb_dry_run){0};
}

static struct vkb_dry_image *find_image(const struct vkb_dry_run *dry_run, const char *name)
{
    for (size_t i = 0; i < dry_run->count; ++i)
        if (strcmp(dry_run->images[i]->row.name, name) == 0)
            return dry_run->images[i];
    return NULL;
}

static bool fits(const struct vkb_dry_image *image, const struct vkb_image_row *row)
{
    return vkb_images_alike(&image->row, row) && (row->usage & ~image->row.usage) == 0;
}

// Returns the content of the image with that row's name. An image of another size, format or
// usage is replaced, as the image cache does it.
static struct vkb_content *resolve(struct vkb_dry_run *dry_run, const struct vkb_image_row *row,
                                   struct vkb_error *error)
{
    struct vkb_dry_image *image = find_image(dry_run, row->name);

    if (!image
        && !(image = vkb_append(error, &dry_run->images, &dry_run->count, &dry_run->capacity,
                                sizeof *image)))
        return NULL;
    const VkImageUsageFlags before = vkb_images_alike(&image->row, row) ? image->row.usage : 0;
    image->content.valid = image->content.valid && fits(image, row);
    image->row = *row;
    image->row.usage |= before;
    return &image->content;
}

static bool note_run(void *context, uint32_t first, uint32_t end, struct vkb_error *error)
{
    bool *ran = context;

    (void)end;
    (void)error;
    ran[first] = true;
    return true;
}

static bool step(struct vkb_dry_run *dry_run, struct vkb_plan_step *planned, bool *ran,
                 struct vkb_error *error)
{
    const struct vkb_graph *graph = &planned->plan->graph;
    struct vkb_content **contents = planned->contents;

    for (uint32_t i = 0; i < graph->image_count; ++i) {
        struct vkb_dry_image *image = find_image(dry_run, graph->images[i].name);
        contents[i] = image && fits(image, &graph->images[i]) ? &image->content : NULL;
        if (!vkb_is_given(&graph->images[i]))
            continue;
        // Pixels are written again to an image that a new usage replaces.
        if (!graph->images[i].serial && image && !contents[i])
            dry_run->source_version = ++dry_run->clock;
        if (!(contents[i] = resolve(dry_run, &graph->images[i], error)))
            return false;
        contents[i]->version =
            graph->images[i].serial ? graph->images[i].serial : dry_run->source_version;
    }
    planned->source = planned->scene = dry_run->source_version;
    if (!vkb_planner_mark(&dry_run->planner, planned, error))
        return false;
    for (uint32_t i = 0; i < graph->image_count; ++i)
        if (dry_run->planner.wanted[i]
            && !(contents[i] = resolve(dry_run, &graph->images[i], error)))
            return false;
    return vkb_planner_run(&dry_run->planner, planned, &dry_run->clock, note_run, ran, error);
}

bool vkb_dry_run_step(struct vkb_dry_run *dry_run, const struct vkb_plan *plan, uint64_t source,
                      bool *ran, struct vkb_error *error)
{
    struct vkb_plan_step planned = {.plan = plan};

    if (!dry_run->source_version || dry_run->source != source)
        dry_run->source_version = ++dry_run->clock;
    dry_run->source = source;
    planned.contents = vkb_alloc(error, plan->graph.image_count, sizeof *planned.contents);
    memset(ran, 0, plan->graph.pass_count * sizeof *ran);
    const bool done = planned.contents && step(dry_run, &planned, ran, error);
    vkb_free(planned.contents);
    return done;
}
