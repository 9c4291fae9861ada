// The adjoints of linear filters. Each reads its taps from the parameters of the forward row.
#include "passes/adjoint.h"
#include "passes/blur.h"
#include "passes/filter.h"

static void set_line(const struct vkb_blur_params *params, int radius, double step, bool placed,
                     struct vkb_axis *axis)
{
    axis->count = 0;
    for (int tap = -radius; tap <= radius; ++tap) {
        const int weight = tap < 0 ? -tap : tap;
        const double place = placed ? params->offsets[weight / 4][weight % 4] : weight;
        if (weight && params->weights[weight / 4][weight % 4] == 0.0f)
            continue;
        axis->taps[axis->count++] = (struct vkb_tap){
            .offset = (tap < 0 ? -place : place) * step,
            .weights = {params->weights[weight / 4][weight % 4]},
        };
    }
}

bool vkb_transpose_blur(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                        struct vkb_error *error)
{
    const struct vkb_blur_params *params = &pass->params.blur;
    const enum vkb_mode direction = (enum vkb_mode)pass->constants.direction;
    const int radius = pass->constants.radius;
    struct vkb_filter filter;

    vkb_filter_begin(adjoint->graph, pass->reads[SLOT_SOURCE], pass->targets[0], &filter);
    filter.gain = params->gain;
    if (direction != DIRECTION_VERTICAL)
        set_line(params, radius, params->step_x, pass->constants.placed, &filter.x);
    if (direction != DIRECTION_HORIZONTAL)
        set_line(params, radius, params->step_y, pass->constants.placed, &filter.y);
    if (pass->constants.upsample)
        filter.x.kind = UPSAMPLE_INSET_LINEAR;
    return vkb_accumulate_filter(adjoint, &filter, vkb_cotangent_of(adjoint, pass),
                                 pass->reads[SLOT_SOURCE], error);
}

static void set_taps(const float (*taps)[4], int32_t count, enum vkb_mode kind,
                     struct vkb_axis *axis)
{
    axis->count = 0;
    for (int32_t i = 0; i < count; ++i) {
        struct vkb_tap *tap = &axis->taps[axis->count++];
        *tap = (struct vkb_tap){.offset = taps[i][0]};
        for (int kernel = 0; kernel < MAX_KERNELS; ++kernel)
            tap->weights[kernel] = taps[i][kernel + 1];
    }
    axis->kind = kind;
}

bool vkb_transpose_filter(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                          struct vkb_error *error)
{
    const struct vkb_filter_params *params = &pass->params.filter;
    const struct vkb_constants *constants = &pass->constants;
    const uint32_t cotangents = vkb_cotangent_of(adjoint, pass);
    struct vkb_filter filter;

    vkb_filter_begin(adjoint->graph, pass->reads[SLOT_SOURCE], pass->targets[0], &filter);
    filter.kernels = (uint32_t)constants->kernels;
    filter.gain = (double)params->coarse / params->divisor;
    set_taps(params->taps_x, constants->taps, (enum vkb_mode)constants->upsample, &filter.x);
    set_taps(params->taps_y, constants->taps, (enum vkb_mode)constants->upsample, &filter.y);
    if (!vkb_accumulate_filter(adjoint, &filter, cotangents, pass->reads[SLOT_SOURCE], error))
        return false;
    if (!constants->add_own)
        return true;
    vkb_filter_begin(adjoint->graph, pass->reads[SLOT_OWN], pass->targets[0], &filter);
    filter.gain = params->own;
    return vkb_accumulate_filter(adjoint, &filter, cotangents, pass->reads[SLOT_OWN], error);
}

// Nine taps, pixels of the target apart.
static void set_nine(const double half[5], enum vkb_border border, struct vkb_axis *axis)
{
    axis->border = border;
    axis->count = 0;
    for (int tap = -4; tap <= 4; ++tap)
        axis->taps[axis->count++] =
            (struct vkb_tap){.offset = tap, .weights = {half[tap < 0 ? -tap : tap]}};
}

// Of Godot's blurs of the frame: weights by brightness are before the horizontal one, at the pixels
// of the target, and after the vertical one.
static bool accumulate_first(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                             const struct vkb_filter *blur, struct vkb_error *error)
{
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

bool vkb_transpose_nine(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                        struct vkb_error *error)
{
    static const double hdrps[] = {HDRP_NINE}, godots[] = {GODOT_NINE};
    const bool godot = pass->constants.tap_set == TAPS_GODOT;
    const bool first =
        godot ? pass->constants.before || pass->constants.after : pass->constants.first_level;
    const bool rows = pass->constants.direction == DIRECTION_HORIZONTAL;
    const enum vkb_border border = godot ? VKB_BORDER_PAIRS
                                 : first ? VKB_BORDER_FIRST_TWO
                                         : VKB_BORDER_LAST;
    const uint32_t source = godot && first ? pass->targets[0] : pass->reads[SLOT_SOURCE];
    struct vkb_filter filter;

    vkb_filter_begin(adjoint->graph, source, pass->targets[0], &filter);
    set_nine(godot ? godots : hdrps, border, rows ? &filter.x : &filter.y);
    if (godot && first)
        return accumulate_first(adjoint, pass, &filter, error);
    filter.gain = godot && !rows ? pass->params.prefilter.strength : 1.0;
    return vkb_accumulate_filter(adjoint, &filter, vkb_cotangent_of(adjoint, pass),
                                 pass->reads[SLOT_SOURCE], error);
}

bool vkb_transpose_gather(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                          struct vkb_error *error)
{
    struct vkb_filter filter;

    for (int level = 0; level < pass->constants.levels; ++level) {
        vkb_filter_begin(adjoint->graph, pass->reads[SLOT_LEVELS + level], pass->targets[0],
                         &filter);
        filter.gain = pass->params.gather.shares[level / 4][level % 4];
        filter.x.kind = filter.y.kind = (enum vkb_mode)pass->constants.upsample;
        if (!vkb_accumulate_filter(adjoint, &filter, vkb_cotangent_of(adjoint, pass),
                                   pass->reads[SLOT_LEVELS + level], error))
            return false;
    }
    return true;
}
