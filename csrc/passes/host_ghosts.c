#include "passes/host_ghosts.h"

#include "passes/host_loops.h"

#include <float.h>
#include <math.h>

// Larger ghosts show less than a pixel.
static const float MOST = 1000.0f;

bool vkb_host_has_ghosts(const struct vkb_pass_row *pass)
{
    const struct vkb_flare_params *params = &pass->params.flare;
    bool fits = vkb_host_loops()->ghosts && !pass->constants.part_above
             && !pass->constants.aberrated && params->falloff == 1.0f && params->vignette == 0.0f
             && params->maximum == FLT_MAX;

    for (int i = 0; i < params->count; ++i)
        fits = fits && fabsf(params->ghosts[i][3]) <= MOST;
    return fits;
}

static struct vkb_ghost_column column_at(const struct vkb_host_ghosts *work, float scale,
                                         uint32_t x)
{
    const float width = (float)work->source.width, centre = 0.5f * width - 0.5f;
    const float start = floorf(centre), offset = scale * ((float)x + 0.5f - 0.5f * width);
    const float moved = centre - start + offset, whole = floorf(moved), part = moved - whole;
    const int32_t texel = (int32_t)(start + whole), last = (int32_t)work->source.width - 1;
    const float share = offset / width;
    struct vkb_ghost_column column = {
        .texel = texel < 0    ? 0
               : texel < last ? texel
                              : last - 1,
        .share = share * share,
    };

    // What is outside of the image has no weight.
    if (texel == -1)
        column.left = part;
    else if (texel == last)
        column.right = 1.0f - part;
    else if (texel >= 0 && texel < last)
        column.left = 1.0f - part, column.right = part;
    return column;
}

bool vkb_host_show_ghosts(const struct vkb_pass_row *pass, const struct vkb_host_image *reads,
                          const struct vkb_host_image *target, struct vkb_workers *workers,
                          struct vkb_error *error)
{
    const struct vkb_flare_params *params = &pass->params.flare;
    const uint32_t count = (uint32_t)params->count, width = target->width;
    struct vkb_host_ghosts work = {
        .params = params,
        .blurs_alpha = pass->constants.alpha == ALPHA_BLUR,
        .source = reads[SLOT_SOURCE],
        .before = pass->constants.adds_image ? reads[SLOT_BEFORE] : (struct vkb_host_image){0},
        .target = *target,
        .columns = vkb_alloc(error, (size_t)count * width, sizeof *work.columns),
    };

    if (!work.columns)
        return false;
    for (uint32_t ghost = 0; ghost < count; ++ghost)
        for (uint32_t x = 0; x < width; ++x)
            work.columns[(size_t)ghost * width + x] = column_at(&work, params->ghosts[ghost][3], x);
    vkb_in_parts(workers, vkb_host_loops()->ghosts, NULL, &work, 0, target->height,
                 target->pitch * target->height * sizeof(float));
    vkb_free(work.columns);
    return true;
}
