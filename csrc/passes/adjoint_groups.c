// The adjoints of downsamplings that weight their taps by brightness, and of first passes of
// published methods: at the pixels of the target the cotangents of each group of taps, and from
// these those of the image by the group's linear filter.
#include "passes/adjoint.h"

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

// The mean of as many texels for each pixel, from the first ones on, or from the last ones back.
static void set_means(struct vkb_axis *axis, int32_t count, bool backwards)
{
    axis->step = count;
    axis->origin = backwards ? axis->from - 1.0 - axis->step * (axis->to - 1.0) : 0.0;
    axis->count = 0;
    for (int32_t i = 0; i < count; ++i)
        axis->taps[axis->count++] = tap_at(backwards ? -i : i, 1.0 / count);
}

// The taps of a group: those of 13 taps are pairs along both axes, but for Blender's, which are
// one tap each.
static void set_group(const struct vkb_pass_row *row, int group, struct vkb_filter *filter)
{
    static const double cross[5][2] = {
        {0.0, 0.0}, {-1.0, 0.0}, {1.0, 0.0}, {0.0, -1.0}, {0.0, 1.0}};
    static const double star[5][2] = {{0.0, 0.0},
                                      {HDRP_FAR, -HDRP_NEAR},
                                      {-HDRP_FAR, HDRP_NEAR},
                                      {HDRP_NEAR, HDRP_FAR},
                                      {-HDRP_NEAR, -HDRP_FAR}};
    const enum vkb_mode groups = (enum vkb_mode)row->constants.groups;
    const double step_x = row->params.prefilter.step_x, step_y = row->params.prefilter.step_y;
    const int corner = group - 1;

    if (groups == GROUPS_KINO || groups == GROUPS_HDRP) {
        const double *place = (groups == GROUPS_KINO ? cross : star)[group];
        filter->x.taps[0].offset = place[0];
        filter->y.taps[0].offset = place[1];
    } else if (groups == GROUPS_BLENDER && group < 9) {
        filter->x.taps[0].offset = 2.0 * (group % 3 - 1);
        filter->y.taps[0].offset = 2.0 * (group / 3 - 1);
    } else if (groups == GROUPS_BLENDER) {
        filter->x.taps[0].offset = (group - 9) & 1 ? 1.0 : -1.0;
        filter->y.taps[0].offset = (group - 9) & 2 ? 1.0 : -1.0;
    } else if (groups == GROUPS_HIGHLIGHTS && row->constants.mean_side > 1) {
        set_means(&filter->x, row->constants.mean_side, false);
        set_means(&filter->y, row->constants.mean_side, true);
    } else if (groups == GROUPS_BOX) {
        filter->x.taps[0].offset = group & 1 ? 1.0 : -1.0;
        filter->y.taps[0].offset = group & 2 ? 1.0 : -1.0;
    } else if (groups == GROUPS_FILAMENT) {
        filter->x.kind = group & 1 ? UPSAMPLE_RIGHT_PAIR : UPSAMPLE_LEFT_PAIR;
        filter->y.kind = group & 2 ? UPSAMPLE_RIGHT_PAIR : UPSAMPLE_LEFT_PAIR;
    } else if (groups == GROUPS_PYGFX) {
        vkb_filter_thirteen(filter, step_x, step_y);
    } else if (group > 0) {
        set_pair(&filter->x, 0.0, corner & 1 ? 2.0 * step_x : -2.0 * step_x);
        set_pair(&filter->y, 0.0, corner & 2 ? 2.0 * step_y : -2.0 * step_y);
    } else if (groups == GROUPS_PYRAMID || groups == GROUPS_BEVY || groups == GROUPS_PYGFX_KARIS) {
        set_pair(&filter->x, -step_x, step_x);
        set_pair(&filter->y, -step_y, step_y);
    }
}

static int count_of(enum vkb_mode groups, const struct vkb_pass_row *pass)
{
    switch (groups) {
    case GROUPS_BLENDER:
        return 13;
    case GROUPS_BOX:
    case GROUPS_FILAMENT:
        return 4;
    case GROUPS_KINO:
        return pass->constants.anti_flicker ? 5 : 1;
    case GROUPS_PYRAMID:
    case GROUPS_BEVY:
    case GROUPS_PYGFX_KARIS:
    case GROUPS_HDRP:
        return 5;
    default:
        return 1;
    }
}

// All groups from one pass, below each other in one image.
static bool accumulate_stacked(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                               const struct vkb_pass_row *given, int count, struct vkb_error *error)
{
    const struct vkb_image_row *target = &adjoint->graph->images[pass->targets[0]];
    const uint32_t height = target->height;
    const struct vkb_size size = {target->width, (uint32_t)count * height};
    struct vkb_pass_row row = *given;
    struct vkb_filter filter;
    uint32_t image;

    row.constants.stacked_groups = count;
    if (!vkb_add_adjoint_image(adjoint, &row, size, &image, error))
        return false;
    for (int group = 0; group < count; ++group) {
        vkb_filter_begin(adjoint->graph, pass->reads[SLOT_SOURCE], pass->targets[0], &filter);
        set_group(&row, group, &filter);
        filter.y.first = (uint32_t)group * height;
        if (!vkb_accumulate_filter(adjoint, &filter, image, pass->reads[SLOT_SOURCE], error))
            return false;
    }
    return true;
}

// Each group by a pass of its own: if there is one, or if an image of all would be too high.
static bool accumulate_each(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                            const struct vkb_pass_row *given, int count, struct vkb_error *error)
{
    struct vkb_pass_row row = *given;
    struct vkb_filter filter;

    for (int group = 0; group < count; ++group) {
        row.constants.own_group = group;
        vkb_filter_begin(adjoint->graph, pass->reads[SLOT_SOURCE], pass->targets[0], &filter);
        set_group(&row, group, &filter);
        if (!vkb_accumulate_through(adjoint, &row, &filter, pass->reads[SLOT_SOURCE],
                                    pass->targets[0], error))
            return false;
    }
    return true;
}

bool vkb_transpose_groups(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                          struct vkb_error *error)
{
    const enum vkb_mode groups = (enum vkb_mode)pass->constants.groups;
    const int count = count_of(groups, pass);
    struct vkb_filter filter;

    if (groups == GROUPS_GODOT || groups == GROUPS_HDRP_BLUR)
        return vkb_transpose_nine(adjoint, pass, error);
    // Without threshold and mask Filament's reduction is a filter.
    if (groups == GROUPS_FILAMENT && !pass->constants.thresholded && !pass->constants.masked) {
        vkb_filter_begin(adjoint->graph, pass->reads[SLOT_SOURCE], pass->targets[0], &filter);
        vkb_filter_three(&filter, 1.0, 0.25);
        return vkb_accumulate_filter(adjoint, &filter, vkb_cotangent_of(adjoint, pass),
                                     pass->reads[SLOT_SOURCE], error);
    }
    const uint32_t height = adjoint->graph->images[pass->targets[0]].height;
    const bool stacked = count > 1 && (uint64_t)count * height <= adjoint->max_side;
    struct vkb_pass_row row = vkb_slope_row(adjoint, pass, &vkb_shader_adjoint_groups_frag);

    row.constants.stacked_groups = 1;
    // Its groups are texels then. The shader reads the mask in the same way.
    if (groups == GROUPS_KINO
        && vkb_same_size(adjoint->graph, row.reads[SLOT_SOURCE], pass->targets[0])
        && (!row.constants.masked
            || vkb_same_size(adjoint->graph, row.reads[SLOT_MASK], pass->targets[0])))
        row.constants.sampling = SAMPLING_TEXEL;
    return (stacked ? accumulate_stacked : accumulate_each)(adjoint, pass, &row, count, error)
        && vkb_accumulate_mask(adjoint, pass, &row, error);
}
