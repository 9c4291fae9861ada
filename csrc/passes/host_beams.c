#include "passes/host_beams.h"

#include "passes/host_loops.h"

#include <string.h>

struct bordering {
    const struct vkb_host_image *from;
    struct vkb_host_image to;
};

static void copy_rows(void *context, uint32_t part, uint32_t first, uint32_t end)
{
    const struct bordering *work = context;
    const struct vkb_host_image *from = work->from, *to = &work->to;

    (void)part;
    for (size_t y = first; y < end; ++y)
        memcpy(to->pixels + (y + 1) * to->pitch + 4, from->pixels + y * from->pitch,
               (size_t)4 * from->width * sizeof(float));
}

// A copy with a texel of zeros around it. Rows are an odd number of cache lines apart, so that
// those of a column share no place in the caches.
static bool copy_with_border(const struct vkb_host_image *image, struct vkb_workers *workers,
                             struct vkb_host_image *copy, struct vkb_error *error)
{
    const size_t line = 16;

    *copy = (struct vkb_host_image){
        .width = image->width + 2,
        .height = image->height + 2,
        .pitch = ((size_t)4 * (image->width + 2) + line - 1) / line * line,
    };
    copy->pitch += copy->pitch / line % 2 == 0 ? line : 0;
    if (!(copy->pixels = vkb_alloc(error, copy->pitch * copy->height, sizeof(float))))
        return false;
    struct bordering work = {image, *copy};
    vkb_in_parts(workers, copy_rows, NULL, &work, 0, image->height,
                 image->pitch * image->height * sizeof(float));
    return true;
}

bool vkb_host_sun_beams(const struct vkb_pass_row *pass, const struct vkb_host_image *reads,
                        const struct vkb_host_image *target, struct vkb_workers *workers,
                        struct vkb_error *error)
{
    const uint32_t across = (target->width + VKB_BEAM_TILE - 1) / VKB_BEAM_TILE;
    const uint32_t down = (target->height + VKB_BEAM_TILE - 1) / VKB_BEAM_TILE;
    struct vkb_host_beams work = {
        .params = &pass->params.sun_beams,
        .jittered = pass->constants.jittered,
        .blurs_alpha = pass->constants.alpha == ALPHA_BLUR,
        .dark = reads[SLOT_DARK],
        .target = *target,
    };

    if (!copy_with_border(&reads[SLOT_SOURCE], workers, &work.source, error))
        return false;
    // A tile takes longer than any copy of its size.
    vkb_in_parts(workers, vkb_host_loops()->beams, NULL, &work, 0, across * down, SIZE_MAX);
    vkb_free(work.source.pixels);
    return true;
}
