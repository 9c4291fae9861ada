// The adjoints of rays of streaks.
#include "passes/adjoint.h"

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

// The taps are at the same distances everywhere, and there is nothing beyond the edges: the
// transpose is the same pass with the opposite distances.
bool vkb_transpose_streaks(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                           struct vkb_error *error)
{
    const uint32_t source = pass->reads[0], cotangents = vkb_cotangent_of(adjoint, pass);
    const struct vkb_image_row *image = &adjoint->graph->images[source];
    const struct vkb_size size = {image->width, image->height};
    struct vkb_pass_row row = *pass;
    uint32_t moved;

    if (pass->constants.add_own && !accumulate_all(adjoint, cotangents, pass->reads[1], error))
        return false;
    row.reads[0] = row.reads[1] = cotangents;
    row.constants.add_own = row.constants.first = 0;
    row.constants.alpha = ALPHA_BLUR;  // one of a cotangent
    row.params.streaks.threshold = 0.0f;
    row.params.streaks.step_x = -pass->params.streaks.step_x;
    row.params.streaks.step_y = -pass->params.streaks.step_y;
    if (!vkb_add_adjoint_row(adjoint, &row, size, &moved, error))
        return false;
    if (!pass->constants.first)
        return accumulate_all(adjoint, moved, source, error);
    row = vkb_slope_row(adjoint, pass, &vkb_shader_adjoint_above_frag, 1);
    row.reads[1] = moved;
    return vkb_accumulate_cotangent(adjoint, &row, source, error);
}
