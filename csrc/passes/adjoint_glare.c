// The adjoints of glare: rays of streaks, ghosts and halo, dirt, and filters along lines.
#include "passes/adjoint.h"

#include <string.h>

// Accumulates the cotangents of another image as they are.
static bool accumulate_all(struct vkb_adjoint *adjoint, uint32_t cotangents, uint32_t image,
                           struct vkb_error *error)
{
    struct vkb_filter filter;

    if (adjoint->cotangents[image] == VKB_NO_IMAGE) {
        adjoint->cotangents[image] = cotangents;
        return true;
    }
    vkb_filter_begin(adjoint->graph, image, cotangents, &filter);
    return vkb_accumulate_filter(adjoint, &filter, cotangents, image, error);
}

// Accumulates the cotangents of an image that the pass adds to its result, if there is one.
static bool accumulate_before(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                              struct vkb_error *error)
{
    return !pass->constants.adds_image
        || accumulate_all(adjoint, vkb_cotangent_of(adjoint, pass), pass->reads[SLOT_BEFORE],
                          error);
}

// The row of a pass that has its own transpose: it reads the cotangents in place of its image.
static struct vkb_pass_row transpose_row(const struct vkb_adjoint *adjoint,
                                         const struct vkb_pass_row *pass)
{
    struct vkb_pass_row row = *pass;

    row.reads[SLOT_SOURCE] = vkb_cotangent_of(adjoint, pass);
    if (pass->constants.adds_image)
        row.reads[SLOT_BEFORE] = VKB_NO_IMAGE;
    row.constants.adds_image = 0;
    row.constants.alpha = ALPHA_BLUR;  // one of a cotangent
    return row;
}

// Adds the row with an image like the pass's own.
static bool add_transpose_row(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                              struct vkb_pass_row *row, uint32_t *image, struct vkb_error *error)
{
    const struct vkb_size size = vkb_size_of(adjoint->graph, pass->reads[SLOT_SOURCE]);

    return vkb_add_adjoint_pass(adjoint, row, size, image, error);
}

// The same, and accumulates its result.
static bool accumulate_transpose_row(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                                     struct vkb_pass_row *row, struct vkb_error *error)
{
    uint32_t image;

    return add_transpose_row(adjoint, pass, row, &image, error)
        && accumulate_all(adjoint, image, pass->reads[SLOT_SOURCE], error);
}

// The transpose of a tap that reads the next texel at some positions is a filter of its own.
static bool accumulate_taps(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                            struct vkb_error *error)
{
    const struct vkb_streaks_params *params = &pass->params.streaks;
    const uint32_t source = pass->reads[SLOT_SOURCE];
    struct vkb_pass_row row = vkb_slope_row(adjoint, pass, &vkb_shader_adjoint_tap_frag);
    struct vkb_filter filter;

    row.reads[SLOT_SOURCE] = VKB_NO_IMAGE;
    for (int tap = 0; tap < params->count; ++tap) {
        vkb_filter_begin(adjoint->graph, source, pass->targets[0], &filter);
        // Rounded as the shader does it.
        filter.x.origin = (float)tap * params->step_x;
        filter.y.origin = (float)tap * params->step_y;
        filter.x.border = filter.y.border = VKB_BORDER_ZERO;
        vkb_filter_next(&filter, params->next[tap]);
        row.constants.streak_tap = tap;
        if (!vkb_accumulate_through(adjoint, &row, &filter, source, pass->targets[0], error))
            return false;
    }
    return true;
}

// The taps are at the same distances everywhere, and there is nothing beyond the edges: the
// transpose is the same pass with the opposite distances.
bool vkb_transpose_streaks(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                           struct vkb_error *error)
{
    struct vkb_pass_row row = transpose_row(adjoint, pass);
    uint32_t moved;

    if (!accumulate_before(adjoint, pass, error))
        return false;
    // Such streaks have no threshold.
    if (pass->params.streaks.reads_next)
        return accumulate_taps(adjoint, pass, error);
    row.constants.part_above = 0;
    row.params.streaks.threshold = 0.0f;
    row.params.streaks.step_x = -pass->params.streaks.step_x;
    row.params.streaks.step_y = -pass->params.streaks.step_y;
    if (!pass->constants.part_above)
        return accumulate_transpose_row(adjoint, pass, &row, error);
    if (!add_transpose_row(adjoint, pass, &row, &moved, error))
        return false;
    row = vkb_slope_row(adjoint, pass, &vkb_shader_adjoint_above_frag);
    row.reads[SLOT_COTANGENTS] = moved;
    return vkb_accumulate_cotangent(adjoint, &row, pass->reads[SLOT_SOURCE], error);
}

// Multiplies the cotangents, as it does the light.
bool vkb_transpose_dirt(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                        struct vkb_error *error)
{
    struct vkb_pass_row row = transpose_row(adjoint, pass);

    return accumulate_transpose_row(adjoint, pass, &row, error);
}

// Blender's recursive filter. Its pixels depend on those before them, the transpose's on those
// after them.
bool vkb_transpose_star(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                        struct vkb_error *error)
{
    struct vkb_pass_row row = transpose_row(adjoint, pass);

    row.shader = &vkb_shader_simple_star_transposed_comp;
    return accumulate_before(adjoint, pass, error)
        && accumulate_transpose_row(adjoint, pass, &row, error);
}

bool vkb_transpose_box(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                       struct vkb_error *error)
{
    struct vkb_pass_row row = transpose_row(adjoint, pass);

    row.shader = &vkb_shader_box_mean_transposed_comp;
    return accumulate_transpose_row(adjoint, pass, &row, error);
}

// An axis that is scaled about its centre.
static void scale_axis(double scale, struct vkb_axis *axis)
{
    axis->step = scale;
    axis->origin = scale * (0.5 - 0.5 * axis->to) + 0.5 * axis->from - 0.5;
    axis->border = VKB_BORDER_ZERO;
}

// A ghost, whose row is that of a pass without others.
static bool accumulate_ghost(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                             const struct vkb_pass_row *row, struct vkb_error *error)
{
    const uint32_t source = pass->reads[SLOT_SOURCE], target = pass->targets[0];
    const float scale = row->params.flare.ghosts[0][3];
    struct vkb_filter filter;

    // What is sampled in the centre alone is not moved.
    if (row->params.flare.aberration > 0.0f && scale != 0.0f)
        return vkb_accumulate_moved(adjoint, row, source, error);
    vkb_filter_begin(adjoint->graph, source, target, &filter);
    scale_axis(scale, &filter.x);
    scale_axis(scale, &filter.y);
    return vkb_accumulate_through(adjoint, row, &filter, source, target, error);
}

// Ghosts, or a halo, which has none.
bool vkb_transpose_flare(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                         struct vkb_error *error)
{
    struct vkb_pass_row row = vkb_slope_row(adjoint, pass, &vkb_shader_adjoint_flare_frag);
    struct vkb_flare_params *params = &row.params.flare;
    const int count = params->count;

    if (!accumulate_before(adjoint, pass, error))
        return false;
    if (count == 0)
        return vkb_accumulate_moved(adjoint, &row, pass->reads[SLOT_SOURCE], error);
    params->count = 1;
    for (int ghost = 0; ghost < count; ++ghost) {
        memcpy(params->ghosts[0], pass->params.flare.ghosts[ghost], sizeof params->ghosts[0]);
        if (!accumulate_ghost(adjoint, pass, &row, error))
            return false;
    }
    return true;
}
