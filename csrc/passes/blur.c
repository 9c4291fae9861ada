#include "passes/blur.h"

#include <math.h>
#include <string.h>

static bool is_integer(double number)
{
    return floor(number) == number;
}

// Distributes each tap to the texels on both sides of it. False if the result is longer than
// LINE_RADIUS.
static bool move_to_texels(const struct vkb_blur *blur, double step, double weights[MAX_WEIGHTS],
                           uint32_t *count)
{
    const double last = ceil((blur->count - 1) * step);

    if (last > LINE_RADIUS)
        return false;
    memset(weights, 0, MAX_WEIGHTS * sizeof *weights);
    weights[0] = blur->weights[0];
    for (uint32_t tap = 1; tap < blur->count; ++tap) {
        const double at = tap * step, part = at - floor(at);
        const int texel = (int)floor(at);
        // The taps on both sides contribute to the centre texel.
        weights[texel] += (texel == 0 ? 2.0 : 1.0) * (1.0 - part) * blur->weights[tap];
        if (part > 0.0)
            weights[texel + 1] += part * blur->weights[tap];
    }
    *count = (uint32_t)last + 1;
    while (*count > 1 && weights[*count - 1] == 0.0)
        --*count;
    return true;
}

struct vkb_pass_row vkb_blur_row(const struct vkb_graph *graph, const char *name,
                                 const struct vkb_blur *blur, uint32_t from, uint32_t to)
{
    struct vkb_pass_row row = vkb_fullscreen_row(name, &vkb_shader_blur_frag, to);
    const bool same_size = vkb_same_size(graph, from, to);
    const bool vertical = blur->direction == DIRECTION_VERTICAL;
    const double step = vertical ? blur->step_y : blur->step_x;
    struct vkb_blur_params *params = &row.params.blur;
    struct vkb_blur moved = *blur;

    if (!blur->offsets && !blur->inset && blur->direction != DIRECTION_BOTH
        && (same_size || is_integer(step))
        && move_to_texels(blur, step, moved.weights, &moved.count))
        moved.step_x = moved.step_y = 1.0;
    vkb_read_only(&row, from);
    row.block = VKB_BLOCK_blur;
    params->step_x = blur->direction == DIRECTION_VERTICAL ? 0.0f : (float)moved.step_x;
    params->step_y = blur->direction == DIRECTION_HORIZONTAL ? 0.0f : (float)moved.step_y;
    VKB_SET_TARGET(&row, blur, &graph->images[to]);
    // In one direction the gain is part of the weights, so that variants need not apply it.
    params->gain = blur->direction == DIRECTION_BOTH ? (float)blur->gain : 1.0f;
    for (uint32_t i = 0; i < moved.count; ++i) {
        const double gain = blur->direction == DIRECTION_BOTH ? 1.0 : blur->gain;
        params->weights[i / 4][i % 4] = (float)(gain * moved.weights[i]);
    }
    for (uint32_t i = 0; blur->offsets && i < moved.count; ++i)
        params->offsets[i / 4][i % 4] = (float)blur->offsets[i];
    row.constants.placed = blur->offsets != NULL;
    row.constants.direction = blur->direction;
    if (blur->inset)
        row.constants.upsample = UPSAMPLE_INSET_LINEAR;
    row.constants.radius = (int32_t)moved.count - 1;
    row.constants.sampling = !blur->offsets && !blur->inset && same_size
                                  && is_integer(params->step_x) && is_integer(params->step_y)
                               ? SAMPLING_TEXEL
                           : blur->filter ? SAMPLING_FILTER
                                          : SAMPLING_FETCH;
    return row;
}

bool vkb_is_line(const struct vkb_pass_row *pass, enum vkb_mode direction, int limit)
{
    const struct vkb_blur_params *params = &pass->params.blur;
    const bool vertical = direction == DIRECTION_VERTICAL;

    return pass->geometry == VKB_GEOMETRY_FULLSCREEN && vkb_computes(pass, VKB_BLOCK_blur)
        && pass->constants.direction == direction && !pass->constants.placed
        && !pass->constants.upsample && (vertical ? params->step_y : params->step_x) == 1.0f
        && pass->constants.radius <= limit;
}
