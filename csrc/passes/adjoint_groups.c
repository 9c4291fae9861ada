// The adjoints of downsamplings that weight their taps by brightness, and of first passes of
// published methods: at the pixels of the target the cotangents of each group of taps, and from
// these those of the image by the group's linear filter.
#include "passes/adjoint.h"

#include <string.h>

static struct vkb_tap tap_at(double offset, double weight)
{
    return (struct vkb_tap){.offset = offset, .weights = {weight}};
}

// Two taps with equal weights.
static void set_pair(struct vkb_axis *axis, double first, double second)
{
    const struct vkb_tap taps[] = {tap_at(first, 0.5), tap_at(second, 0.5)};

    vkb_axis_set(axis, taps, 2);
}

// The taps of a group: those of 13 taps are pairs along both axes, those of a box or a cross one
// tap each.
static void set_group(enum vkb_mode groups, int group, double step_x, double step_y,
                      struct vkb_filter *filter)
{
    if (groups == GROUPS_BOX) {
        const struct vkb_tap x = tap_at(group & 1 ? 1.0 : -1.0, 1.0);
        const struct vkb_tap y = tap_at(group & 2 ? 1.0 : -1.0, 1.0);
        vkb_axis_set(&filter->x, &x, 1);
        vkb_axis_set(&filter->y, &y, 1);
    } else if (group == 0 && (groups == GROUPS_BEVY || groups == GROUPS_PYRAMID)) {
        set_pair(&filter->x, -step_x, step_x);
        set_pair(&filter->y, -step_y, step_y);
    } else if (groups == GROUPS_KINO) {
        const struct vkb_tap tap = tap_at(group & 1 ? -1.0 : 1.0, 1.0);
        if (group > 0)
            vkb_axis_set(group < 3 ? &filter->x : &filter->y, &tap, 1);
    } else if (group > 0) {
        const int corner = group - 1;
        set_pair(&filter->x, 0.0, corner & 1 ? 2.0 * step_x : -2.0 * step_x);
        set_pair(&filter->y, 0.0, corner & 2 ? 2.0 * step_y : -2.0 * step_y);
    }
}

// The parameters that the shader reads, from the block of the forward pass.
static void take_params(const struct vkb_pass_row *pass, struct vkb_prefilter_params *params)
{
    if (pass->block == VKB_BLOCK_prefilter) {
        *params = pass->params.prefilter;
        return;
    }
    memset(params, 0, sizeof *params);
    params->target_width = pass->params.pyramid.target_width;
    params->target_height = pass->params.pyramid.target_height;
    params->step_x = pass->params.pyramid.step_x;
    params->step_y = pass->params.pyramid.step_y;
}

// The groups by the shader of the forward pass.
static enum vkb_mode groups_of(const struct vkb_pass_row *pass)
{
    static const struct {
        const struct vkb_shader *shader;
        enum vkb_mode groups;
    } known[] = {
        {&vkb_shader_box_down_frag, GROUPS_BOX},
        {&vkb_shader_bevy_prefilter_frag, GROUPS_BEVY},
        {&vkb_shader_urp_prefilter_frag, GROUPS_URP},
        {&vkb_shader_unreal_prefilter_frag, GROUPS_UNREAL},
        {&vkb_shader_kino_prefilter_frag, GROUPS_KINO},
    };

    for (size_t i = 0; i < sizeof known / sizeof known[0]; ++i)
        if (known[i].shader == pass->shader)
            return known[i].groups;
    return GROUPS_PYRAMID;
}

static int count_of(enum vkb_mode groups, const struct vkb_pass_row *pass)
{
    switch (groups) {
    case GROUPS_BOX:
        return 4;
    case GROUPS_URP:
    case GROUPS_UNREAL:
        return 1;
    case GROUPS_KINO:
        return pass->constants.anti_flicker ? 5 : 1;
    default:
        return 5;
    }
}

bool vkb_transpose_groups(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                          struct vkb_error *error)
{
    const enum vkb_mode groups = groups_of(pass);
    const int count = count_of(groups, pass);
    const uint32_t target = pass->targets[0];
    const uint32_t reads[] = {pass->reads[0], pass->reads[pass->constants.masked ? 1 : 0],
                              vkb_brought(adjoint, pass)};
    struct vkb_pass_row row = vkb_adjoint_row(&vkb_shader_adjoint_groups_frag, reads, 3);
    struct vkb_filter filter;

    row.constants = pass->constants;
    row.constants.groups = groups;
    row.block = VKB_BLOCK_prefilter;
    take_params(pass, &row.params.prefilter);
    for (int group = 0; group < count; ++group) {
        row.constants.levels = group;
        vkb_filter_begin(adjoint->graph, pass->reads[0], target, &filter);
        set_group(groups, group, row.params.prefilter.step_x, row.params.prefilter.step_y, &filter);
        if (!vkb_bring_through(adjoint, &row, &filter, pass->reads[0], target, error))
            return false;
    }
    if (!pass->constants.masked)
        return true;
    row.constants.by = BY_MASK;
    vkb_filter_begin(adjoint->graph, pass->reads[1], target, &filter);
    return vkb_bring_through(adjoint, &row, &filter, pass->reads[1], target, error);
}
