#include "passes/prefilter.h"

#include "passes/tap_sets.h"

#include <string.h>

struct choice {
    int32_t taps, combine, before, after;
};

#define CHOICE_ROW(name, taps, combine, before, after) \
    [VKB_PREFILTER_##name] = {taps, combine, before, after},

static const struct choice choices[] = {PREFILTERS(CHOICE_ROW)};

struct vkb_pass_row vkb_describe_prefilter(const struct vkb_levels *levels,
                                           enum vkb_prefilter prefilter, uint32_t from, uint32_t to)
{
    const struct choice *choice = &choices[prefilter];
    const struct vkb_shader *shader =
        vkb_is_line_set(choice->taps) ? &vkb_shader_nine_frag : &vkb_shader_prefilter_frag;
    struct vkb_pass_row row = vkb_prefilter_row(levels, shader, from, to);

    row.constants.tap_set = choice->taps;
    row.constants.combine = choice->combine;
    row.constants.before = choice->before;
    row.constants.after = choice->after;
    vkb_set_steps(&row, 1.0, 1.0);
    return row;
}

void vkb_set_steps(struct vkb_pass_row *row, double step_x, double step_y)
{
    row->params.prefilter.step_x = (float)step_x;
    row->params.prefilter.step_y = (float)step_y;
}

void vkb_set_tint(struct vkb_pass_row *row, const float *tint)
{
    memcpy(row->params.prefilter.tint[0], tint, 3 * sizeof *tint);
}

bool vkb_is_mean(const struct vkb_pass_row *pass)
{
    return pass->constants.combine == COMBINE_MEAN && pass->constants.before == POINT_NONE;
}

bool vkb_is_linear(const struct vkb_pass_row *pass)
{
    return vkb_is_mean(pass) && pass->constants.after == POINT_NONE && !pass->constants.masked;
}

bool vkb_has_colour(const struct vkb_pass_row *pass)
{
    return pass->constants.after == POINT_URP || pass->constants.after == POINT_PPV2;
}

#define IS_COMBINATION(name, value, weight) || combine == name
#define SKIP_COMBINATION(name, value, weight)

bool vkb_differs_by_tap(const struct vkb_pass_row *pass)
{
    const int32_t combine = pass->constants.combine;
    const bool weighs_taps =
        false COMBINATIONS(SKIP_COMBINATION, SKIP_COMBINATION, IS_COMBINATION, SKIP_COMBINATION);

    return pass->constants.before != POINT_NONE || weighs_taps;
}
