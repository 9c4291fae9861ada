// The adjoints of linear filters, and of passes that are linear but for points before or after.
#include "passes/adjoint.h"
#include "passes/filter.h"
#include "passes/taps.h"

#include <math.h>
#include <stdio.h>

// If they are wanted, the sums by the shares of a level and of a smaller one.
static bool add_share_sums(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                           struct vkb_error *error)
{
    const struct vkb_size size = vkb_size_of(adjoint->graph, pass->targets[0]);
    struct vkb_pass_row row =
        vkb_adjoint_row(&vkb_shader_adjoint_shares_frag, vkb_cotangent_of(adjoint, pass));
    char name[VKB_NAME_SIZE];

    if (!adjoint->sums.shares || !pass->constants.adds_image)
        return true;
    row.constants.alpha = adjoint->alpha;
    row.reads[SLOT_SOURCE] = pass->targets[0];
    vkb_read_at(&row, SLOT_SAME_SIZE, pass->reads[SLOT_SAME_SIZE]);
    snprintf(name, sizeof name, ".by_shares_%u", adjoint->mixed++);
    return vkb_add_sum_passes(adjoint, &row, row.shader, size, name, error);
}

// If they are wanted, the sums by factors of one of the images that a pass adds up, all of whose
// cotangents are from this pass so far: of levels, or of the bloom and the stages of glare.
static bool add_level_sums(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                           uint32_t level, uint32_t number, struct vkb_error *error)
{
    const bool stages = pass->targets[0] == adjoint->lights;
    char name[VKB_NAME_SIZE];

    if (!(stages ? adjoint->sums.stages : adjoint->sums.levels)
        || pass->shader != &vkb_shader_gather_frag)
        return true;
    snprintf(name, sizeof name, stages ? ".by_stages_%u" : ".by_levels_%u", number);
    return vkb_add_product_sums(adjoint, adjoint->cotangents[level], level, name, error);
}

// The sum of the image that a filter reads, times the filter's transpose.
static bool add_filter_sums(struct vkb_adjoint *adjoint, const struct vkb_filter *filter,
                            const char *name, uint32_t cotangents, uint32_t image,
                            struct vkb_error *error)
{
    const uint32_t before = adjoint->cotangents[image];
    const uint32_t scene = adjoint->scene, glow = adjoint->glow;

    // The result is the only cotangents of the image for a moment, and none of another one.
    adjoint->cotangents[image] = adjoint->scene = adjoint->glow = VKB_NO_IMAGE;
    adjoint->of_sums = true;
    const bool done = vkb_accumulate_filter(adjoint, filter, cotangents, image, error);
    const uint32_t made = adjoint->cotangents[image];
    adjoint->cotangents[image] = before;
    adjoint->scene = scene;
    adjoint->glow = glow;
    adjoint->of_sums = false;
    return done && vkb_add_product_sums(adjoint, made, image, name, error);
}

static bool wants_distances(const struct vkb_adjoint *adjoint, const struct vkb_filter *filter,
                            const struct vkb_axis *axis)
{
    return (filter->enlarges ? adjoint->sums.enlarging : adjoint->sums.reducing)
        && vkb_axis_has_distances(axis);
}

// The sums by a factor of the distances of an axis' taps: with slopes in place of samples. The axis
// is one of the filter, which stays as it is.
static bool add_distance_sums(struct vkb_adjoint *adjoint, const struct vkb_filter *filter,
                              struct vkb_axis *axis, uint32_t cotangents, uint32_t image,
                              struct vkb_error *error)
{
    char name[VKB_NAME_SIZE];

    snprintf(name, sizeof name, ".by_%s_%s_%u", filter->enlarges ? "enlarging" : "reducing",
             axis == &filter->x ? "x" : "y", adjoint->moved++);
    axis->slopes = true;
    const bool done = add_filter_sums(adjoint, filter, name, cotangents, image, error);
    axis->slopes = false;
    return done;
}

// Adds the sums by so many weights of an axis' kernel in each pass, from what the transpose along
// the other axis has made of the cotangents.
static bool add_kernel_passes(struct vkb_adjoint *adjoint, struct vkb_pass_row *row,
                              const struct vkb_axis *axis, uint32_t in_each, const char *kind,
                              struct vkb_error *error)
{
    const struct vkb_size size = vkb_size_of(adjoint->graph, row->reads[SLOT_COTANGENTS]);
    bool done = true;

    row->block = VKB_BLOCK_filter;
    row->constants.alpha = adjoint->alpha;
    row->constants.radius = (int32_t)axis->kernel.count - 1;
    for (uint32_t pass = 0; done && in_each * pass < axis->kernel.count; ++pass) {
        char name[VKB_NAME_SIZE];
        snprintf(name, sizeof name, ".by_%s_%u_%u", kind, pass, adjoint->moved++);
        row->constants.first_sample = (int32_t)(in_each * pass);
        done = vkb_add_sum_passes(adjoint, row, row->shader, size, name, error);
    }
    return done;
}

// The sums by the weights of an axis' kernel.
static bool add_weight_sums(struct vkb_adjoint *adjoint, const struct vkb_axis *axis, bool along_x,
                            uint32_t half, uint32_t image, struct vkb_error *error)
{
    const double step = axis->kernel.step;
    struct vkb_pass_row row = vkb_adjoint_row(&vkb_shader_adjoint_kernel_frag, half);

    row.reads[SLOT_SOURCE] = image;
    row.params.filter.step_x = along_x ? (float)step : 0.0f;
    row.params.filter.step_y = along_x ? 0.0f : (float)step;
    VKB_SET_TARGET(&row, filter, &adjoint->graph->images[half]);
    row.constants.direction = along_x ? DIRECTION_HORIZONTAL : DIRECTION_VERTICAL;
    row.constants.sampling =
        axis->from == axis->to && step == floor(step) ? SAMPLING_TEXEL : SAMPLING_FETCH;
    return add_kernel_passes(adjoint, &row, axis, 4, "weight", error);
}

// Whether the taps of an axis are at the same distances from all texels, and adjoint_taps.frag has
// room for their numbers.
static bool has_fixed_taps(const struct vkb_axis *axis)
{
    const struct vkb_pass_row *const row = NULL;

    return axis->from == axis->to && axis->origin == 0.0 && axis->step == 1.0 && axis->first == 0
        && axis->kernel.count
               <= sizeof row->params.filter.weights / sizeof *row->params.filter.weights;
}

// The sums by the weights of such an axis, and by a factor of the distances of its taps: a step
// that learns all fields of `tutorial` takes 2.45 times a step, and 2.69 to 3.04 with passes for
// each (an H200, 3840 x 2160, RGB in float32, 2026-12-01).
static bool add_fixed_tap_sums(struct vkb_adjoint *adjoint, const struct vkb_axis *axis,
                               bool along_x, uint32_t half, uint32_t image, struct vkb_error *error)
{
    const uint32_t middle = axis->kernel.count - 1;
    struct vkb_pass_row row = vkb_adjoint_row(&vkb_shader_adjoint_taps_frag, half);

    row.reads[SLOT_SOURCE] = image;
    row.constants.direction = along_x ? DIRECTION_HORIZONTAL : DIRECTION_VERTICAL;
    for (uint32_t i = 1; i <= middle; ++i) {
        const struct vkb_tap tap = vkb_axis_tap(axis, middle + i);
        float *const numbers = row.params.filter.weights[i];
        const bool centred = vkb_is_centred(tap.offset);
        const double whole = floor(tap.offset + (centred ? 0.5 : 0.0));
        numbers[0] = (float)whole;
        numbers[1] = centred ? 0.0f : (float)(tap.offset - whole);
        numbers[2] = (float)(tap.weights[0] * tap.offset * (centred ? 0.5 : 1.0));
        numbers[3] = centred;
    }
    return add_kernel_passes(adjoint, &row, axis, 3, "taps", error);
}

// The sums by what the taps of an axis have, if any are wanted. The axis is one of the filter.
static bool add_axis_sums(struct vkb_adjoint *adjoint, struct vkb_filter *filter,
                          struct vkb_axis *axis, uint32_t cotangents, uint32_t image,
                          struct vkb_error *error)
{
    const bool along_x = axis == &filter->x;
    const bool moves = wants_distances(adjoint, filter, axis);
    struct vkb_filter across = *filter, along = *filter;
    uint32_t half;

    if (!adjoint->sums.weight || axis->kernel.count == 0)
        return !moves || add_distance_sums(adjoint, filter, axis, cotangents, image, error);
    // Both sums take the transpose along the other axis from here.
    vkb_axis_move(along_x ? &across.x : &across.y, axis->to, axis->to, 0.0);
    adjoint->of_sums = true;
    const bool done =
        vkb_filter_to_image(adjoint, &across, cotangents,
                            (struct vkb_size){across.x.from, across.y.from}, &half, error);
    adjoint->of_sums = false;
    if (!done)
        return false;
    struct vkb_axis *kept = along_x ? &along.y : &along.x;
    vkb_axis_move(kept, kept->from, kept->from, 0.0);
    along.gain = along.divisor;
    struct vkb_axis *own = along_x ? &along.x : &along.y;
    if (moves && has_fixed_taps(own))
        return add_fixed_tap_sums(adjoint, own, along_x, half, image, error);
    return (!moves || add_distance_sums(adjoint, &along, own, half, image, error))
        && add_weight_sums(adjoint, axis, along_x, half, image, error);
}

// The sums by what the taps of a filter have, if any are wanted.
static bool add_tap_sums(struct vkb_adjoint *adjoint, const struct vkb_filter *given,
                         uint32_t cotangents, uint32_t image, struct vkb_error *error)
{
    const struct vkb_wanted_sums *sums = &adjoint->sums;
    struct vkb_filter filter;

    if (!sums->enlarging && !sums->reducing && !sums->weight)
        return true;
    filter = *given;
    if (given->x.unmoved)
        filter.x = *given->x.unmoved;
    if (given->y.unmoved)
        filter.y = *given->y.unmoved;
    return add_axis_sums(adjoint, &filter, &filter.x, cotangents, image, error)
        && add_axis_sums(adjoint, &filter, &filter.y, cotangents, image, error);
}

bool vkb_transpose_filters(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                           struct vkb_error *error)
{
    const uint32_t cotangents = vkb_cotangent_of(adjoint, pass);

    if (!add_share_sums(adjoint, pass, error))
        return false;
    // The pass before has no cotangents then, unless its result is a framebuffer that has its own.
    if (pass->joined)
        return add_tap_sums(adjoint, pass->joined, cotangents, pass->joined_from, error)
            && vkb_accumulate_filter(adjoint, pass->joined, cotangents, pass->joined_from, error);
    for (uint32_t i = 0; i < pass->filter_count; ++i) {
        const uint32_t level = pass->reads[SLOT_LEVELS + i];
        const bool is_alone = adjoint->cotangents[level] == VKB_NO_IMAGE;
        if (!add_tap_sums(adjoint, &pass->filters[i], cotangents, level, error)
            || !vkb_accumulate_filter(adjoint, &pass->filters[i], cotangents, level, error)
            || (is_alone && !add_level_sums(adjoint, pass, level, i, error)))
            return false;
    }
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

    if (!vkb_add_threshold_sums(adjoint, pass, &row, &vkb_shader_adjoint_nine_sums_frag, error))
        return false;
    if (pass->constants.direction == DIRECTION_HORIZONTAL)
        return vkb_filter_to_image(adjoint, blur, row.reads[SLOT_COTANGENTS], size,
                                   &row.reads[SLOT_COTANGENTS], error)
            && vkb_accumulate_sampled(adjoint, &row, source, target, error);
    return vkb_accumulate_through(adjoint, &row, blur, source, target, error)
        && vkb_accumulate_mask(adjoint, pass, &row, error);
}
