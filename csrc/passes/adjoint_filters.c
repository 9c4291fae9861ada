// The adjoints of linear filters, and of passes that are linear but for points before or after.
#include "passes/adjoint.h"
#include "passes/filter.h"

bool vkb_transpose_filters(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                           struct vkb_error *error)
{
    const uint32_t cotangents = vkb_cotangent_of(adjoint, pass);

    // The pass before has no cotangents then, unless its result is a framebuffer that has its own.
    if (pass->joined)
        return vkb_accumulate_filter(adjoint, pass->joined, cotangents, pass->joined_from, error);
    for (uint32_t i = 0; i < pass->filter_count; ++i)
        if (!vkb_accumulate_filter(adjoint, &pass->filters[i], cotangents,
                                   pass->reads[SLOT_LEVELS + i], error))
            return false;
    return true;
}

// Of Godot's blurs of the frame: weights by brightness are before the horizontal one, at the pixels
// of the target, and after the vertical one.
bool vkb_transpose_nine(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                        struct vkb_error *error)
{
    const struct vkb_filter *blur = pass->filters;
    const uint32_t target = pass->targets[0], source = pass->reads[SLOT_SOURCE];
    const struct vkb_size size = {blur->x.to, blur->y.to};
    struct vkb_pass_row row = vkb_slope_row(adjoint, pass, &vkb_shader_adjoint_nine_frag);

    if (pass->constants.direction == DIRECTION_HORIZONTAL)
        return vkb_filter_to_image(adjoint, blur, row.reads[SLOT_COTANGENTS], size,
                                   &row.reads[SLOT_COTANGENTS], error)
            && vkb_accumulate_sampled(adjoint, &row, source, target, error);
    return vkb_accumulate_through(adjoint, &row, blur, source, target, error)
        && vkb_accumulate_mask(adjoint, pass, &row, error);
}
