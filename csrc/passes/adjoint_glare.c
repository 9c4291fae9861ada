// The adjoints of glare: rays of streaks, ghosts, stars, dirt, and the prefilter of a
// convolution.
#include "passes/adjoint.h"

#include <stdio.h>

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

// Adds a row of a forward shader with a new image. Its alpha is one of a cotangent, not 1.
static bool add_forward(struct vkb_adjoint *adjoint, struct vkb_pass_row *row, uint32_t like,
                        uint32_t *image, struct vkb_error *error)
{
    const struct vkb_image_row *forward = &adjoint->graph->images[like];
    const struct vkb_size size = {forward->width, forward->height};

    snprintf(row->name, sizeof row->name, "adjoint_%u", adjoint->added++);
    if (!vkb_add_target(adjoint->graph, row->name, VKB_FORMAT_RGBA32_FLOAT, size, false, image,
                        error))
        return false;
    row->targets[0] = *image;
    row->constants.alpha = ALPHA_BLUR;
    return vkb_graph_add_pass(adjoint->graph, row, error);
}

// The taps are at the same distances everywhere, and there is nothing beyond the edges: the
// transpose is the same pass with the opposite distances.
bool vkb_transpose_streaks(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                           struct vkb_error *error)
{
    const uint32_t source = pass->reads[0], cotangents = vkb_cotangent_of(adjoint, pass);
    struct vkb_pass_row row = *pass;
    uint32_t moved;

    if (pass->constants.add_own && !accumulate_all(adjoint, cotangents, pass->reads[1], error))
        return false;
    row.reads[0] = row.reads[1] = cotangents;
    row.constants.add_own = row.constants.first = 0;
    row.params.streaks.threshold = 0.0f;
    row.params.streaks.step_x = -pass->params.streaks.step_x;
    row.params.streaks.step_y = -pass->params.streaks.step_y;
    if (!add_forward(adjoint, &row, source, &moved, error))
        return false;
    if (!pass->constants.first)
        return accumulate_all(adjoint, moved, source, error);
    row = vkb_slope_row(adjoint, pass, &vkb_shader_adjoint_above_frag, 1);
    row.reads[1] = moved;
    return vkb_accumulate_cotangent(adjoint, &row, source, error);
}

// Multiplies the cotangents, as it does the light.
bool vkb_transpose_dirt(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                        struct vkb_error *error)
{
    struct vkb_pass_row row = *pass;
    uint32_t image;

    row.reads[0] = vkb_cotangent_of(adjoint, pass);
    return add_forward(adjoint, &row, pass->reads[0], &image, error)
        && accumulate_all(adjoint, image, pass->reads[0], error);
}

// An axis that is scaled about its centre.
static void scale_axis(double scale, struct vkb_axis *axis)
{
    axis->step = scale;
    axis->origin = scale * (0.5 - 0.5 * axis->to) + 0.5 * axis->from - 0.5;
    axis->border = VKB_BORDER_ZERO;
}

// Ghosts. A halo, and colours that are moved along the radius, are left to the reference.
bool vkb_transpose_flare(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                         struct vkb_error *error)
{
    const struct vkb_flare_params *params = &pass->params.flare;
    const uint32_t source = pass->reads[0], target = pass->targets[0];
    struct vkb_pass_row row = vkb_slope_row(adjoint, pass, &vkb_shader_adjoint_flare_frag, 1);
    struct vkb_filter filter;

    if (pass->constants.add_own && !accumulate_all(adjoint, row.reads[1], pass->reads[1], error))
        return false;
    row.constants.add_own = 0;
    for (int ghost = 0; ghost < params->count; ++ghost) {
        const float scale = params->ghosts[ghost][3];
        row.constants.levels = ghost;
        vkb_filter_begin(adjoint->graph, source, target, &filter);
        scale_axis(scale, &filter.x);
        scale_axis(scale, &filter.y);
        if (!vkb_accumulate_through(adjoint, &row, &filter, source, target, error))
            return false;
    }
    return true;
}

// Blender's recursive filter. Its pixels depend on those before them, the transpose's on those
// after them.
bool vkb_transpose_star(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                        struct vkb_error *error)
{
    const uint32_t cotangents = vkb_cotangent_of(adjoint, pass);
    struct vkb_pass_row row = *pass;

    if (pass->constants.add_own && !accumulate_all(adjoint, cotangents, pass->reads[1], error))
        return false;
    row.shader = &vkb_shader_adjoint_star_comp;
    row.reads[0] = cotangents;
    row.read_count = 1;
    return vkb_accumulate_cotangent(adjoint, &row, pass->reads[0], error);
}

bool vkb_transpose_bright(struct vkb_adjoint *adjoint, const float prefilter[3], uint32_t glow,
                          uint32_t cotangents, enum vkb_mode alpha, struct vkb_error *error)
{
    const uint32_t reads[] = {glow, cotangents};
    struct vkb_pass_row row = vkb_adjoint_row(&vkb_shader_adjoint_bright_frag, reads, 2);

    row.constants.alpha = alpha;
    row.block = VKB_BLOCK_adjoint_bright;
    row.params.adjoint_bright = (struct vkb_adjoint_bright_params){
        .prefilter_min = prefilter[0],
        .prefilter_max = prefilter[1],
        .prefilter_factor = prefilter[2],
    };
    return vkb_accumulate_cotangent(adjoint, &row, glow, error);
}
