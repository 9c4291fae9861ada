#include "graph/filter.h"

#include "graph/graph.h"

#include <string.h>

static void begin_axis(uint32_t from, uint32_t to, struct vkb_axis *axis)
{
    const struct vkb_tap centre = {.weights = {1.0}};
    const double step = (double)from / to;

    *axis = (struct vkb_axis){
        .from = from, .to = to, .origin = 0.5 * step - 0.5, .step = step, .kind = UPSAMPLE_LINEAR};
    vkb_axis_set(axis, &centre, 1);
}

void vkb_filter_begin(const struct vkb_graph *graph, uint32_t from, uint32_t to,
                      struct vkb_filter *filter)
{
    const struct vkb_image_row *source = &graph->images[from], *target = &graph->images[to];

    begin_axis(source->width, target->width, &filter->x);
    begin_axis(source->height, target->height, &filter->y);
    filter->kernels = 1;
    filter->gain = 1.0;
    filter->divisor = 1.0;
    filter->enlarges = false;
}

void vkb_axis_move(struct vkb_axis *axis, uint32_t from, uint32_t to, double origin)
{
    begin_axis(from, to, axis);
    axis->origin = origin;
    axis->step = 1.0;
}

void vkb_axis_align(struct vkb_axis *axis, double step, int32_t first)
{
    axis->step = step;
    axis->origin = 0.5 * step - 0.5 + first;
}

int32_t vkb_axis_first(const struct vkb_axis *axis)
{
    return (int32_t)(axis->origin - (0.5 * axis->step - 0.5));
}

bool vkb_axis_is_moved(const struct vkb_axis *axis)
{
    return vkb_axis_first(axis) != 0 || axis->step != (double)axis->from / axis->to;
}

void vkb_axis_set(struct vkb_axis *axis, const struct vkb_tap *taps, uint32_t count)
{
    memcpy(axis->taps, taps, count * sizeof *taps);
    axis->count = count;
}

uint32_t vkb_axis_count(const struct vkb_axis *axis)
{
    return axis->kernel.count ? 2 * axis->kernel.count - 1 : axis->count;
}

struct vkb_tap vkb_axis_tap(const struct vkb_axis *axis, uint32_t number)
{
    const struct vkb_kernel *kernel = &axis->kernel;

    if (!kernel->count)
        return axis->taps[number];
    const uint32_t middle = kernel->count - 1;
    const uint32_t side = number < middle ? middle - number : number - middle;
    const double distance = kernel->step * (kernel->placed ? kernel->offsets[side] : side);

    return (struct vkb_tap){
        .offset = number < middle ? -distance : distance,
        .weights = {kernel->weights[side]},
    };
}

void vkb_axis_take(struct vkb_axis *axis, uint32_t kernel)
{
    uint32_t count = 0;

    for (uint32_t i = 0; i < axis->count; ++i)
        if (axis->taps[i].weights[kernel] != 0.0)
            axis->taps[count++] = (struct vkb_tap){.offset = axis->taps[i].offset,
                                                   .weights = {axis->taps[i].weights[kernel]}};
    axis->count = count;
}

void vkb_filter_next(struct vkb_filter *filter, const float next[4])
{
    filter->x.next = (uint32_t)next[0];
    filter->y.next = (uint32_t)next[1];
    filter->y.backwards = true;
}

int32_t vkb_ratio_of(uint32_t source, uint32_t target)
{
    return source == 2 * target ? EXACT_HALF
         : source == target     ? EXACT_SAME
         : 2 * source == target ? EXACT_DOUBLE
                                : 0;
}

int32_t vkb_axis_ratio(const struct vkb_axis *axis)
{
    return axis->step == 2.0 ? EXACT_HALF
         : axis->step == 1.0 ? EXACT_SAME
         : axis->step == 0.5 ? EXACT_DOUBLE
                             : 0;
}

bool vkb_axis_has_distances(const struct vkb_axis *axis)
{
    bool has_distances = false;

    for (uint32_t i = 0; i < vkb_axis_count(axis); ++i)
        has_distances = has_distances || vkb_axis_tap(axis, i).offset != 0.0;
    return has_distances && axis->kind == UPSAMPLE_LINEAR && axis->border == VKB_BORDER_NONE
        && axis->next == 0;
}

bool vkb_axis_is_identity(const struct vkb_axis *axis)
{
    const struct vkb_tap tap = vkb_axis_tap(axis, 0);

    return axis->from == axis->to && axis->origin == 0.0 && axis->step == 1.0 && axis->first == 0
        && axis->kind == UPSAMPLE_LINEAR && !axis->slopes && axis->next == 0
        && vkb_axis_count(axis) == 1 && tap.offset == 0.0 && tap.weights[0] == 1.0;
}
