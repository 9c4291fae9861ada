#include "passes/filter.h"

#include <math.h>
#include <string.h>

struct vkb_pass_row vkb_fetching_row(const struct vkb_levels *levels,
                                     const struct vkb_shader *fragment, uint32_t from, uint32_t to)
{
    struct vkb_pass_row row = vkb_fullscreen_row(levels->graph->images[to].name, fragment, to);

    vkb_read_only(&row, from);
    // Filtered in the shader: lavapipe's sampler keeps 8 bits of the position, and the errors of a
    // chain add up.
    row.constants.sampling = SAMPLING_FETCH;
    return row;
}

struct vkb_pass_row vkb_row_of_lines(const struct vkb_levels *levels,
                                     const struct vkb_shader *shader, uint32_t lines, uint32_t from,
                                     uint32_t to)
{
    struct vkb_pass_row row = vkb_fetching_row(levels, shader, from, to);

    row.geometry = VKB_GEOMETRY_DISPATCH;
    row.vertex = NULL;
    row.variant = "dispatch";
    row.block_width = row.block_height = 1;
    row.groups_width = (lines + ROW_INVOCATIONS - 1) / ROW_INVOCATIONS;
    row.groups_height = 1;
    return row;
}

struct vkb_kernel vkb_sides(double distance, double side, double middle)
{
    return (struct vkb_kernel){
        .count = 2,
        .placed = true,
        .step = 1.0,
        .weights = {middle, side},
        .offsets = {0.0, distance},
    };
}

struct vkb_kernel vkb_centre(void)
{
    return (struct vkb_kernel){.count = 1, .step = 1.0, .weights = {1.0}};
}

// Adds the taps of a kernel to an axis.
static void add_taps(struct vkb_axis *axis, const struct vkb_kernel *kernel, uint32_t number)
{
    const struct vkb_axis whole = {.kernel = *kernel};

    for (uint32_t i = 0; i < vkb_axis_count(&whole); ++i) {
        const struct vkb_tap tap = vkb_axis_tap(&whole, i);
        if (tap.weights[0] == 0.0)
            continue;
        axis->taps[axis->count] = (struct vkb_tap){.offset = tap.offset};
        axis->taps[axis->count].weights[number] = tap.weights[0];
        ++axis->count;
    }
}

// Replaces the taps of both axes by those of the kernels.
static void set_kernels(struct vkb_filter *filter, const struct vkb_kernel (*kernels)[2],
                        uint32_t count)
{
    filter->kernels = count;
    filter->x.count = filter->y.count = 0;
    for (uint32_t i = 0; i < count; ++i) {
        add_taps(&filter->x, &kernels[i][0], i);
        add_taps(&filter->y, &kernels[i][1], i);
    }
}

struct vkb_filter vkb_make_filter(const struct vkb_graph *graph, uint32_t from, uint32_t to,
                                  const struct vkb_kernel (*kernels)[2], uint32_t count,
                                  double gain)
{
    struct vkb_filter filter;

    vkb_filter_begin(graph, from, to, &filter);
    set_kernels(&filter, kernels, count);
    filter.gain = gain;
    return filter;
}

void vkb_filter_three(struct vkb_filter *filter, double distance, double side)
{
    const struct vkb_kernel kernel = vkb_sides(distance, side, 1.0 - 2.0 * side);
    const struct vkb_kernel kernels[][2] = {{kernel, kernel}};

    set_kernels(filter, kernels, 1);
}

bool vkb_is_moved(const struct vkb_filter *filter)
{
    return vkb_axis_is_moved(&filter->x) || vkb_axis_is_moved(&filter->y);
}

void vkb_set_kind(struct vkb_filter *filter, enum vkb_mode kind)
{
    filter->x.kind = filter->y.kind = kind;
}

// Fills the table of an axis, in which there is one of several taps at the same place. Returns the
// number of places, of which the table holds MAX_FILTER_TAPS.
static uint32_t fill_taps(const struct vkb_axis *axis, float table[MAX_FILTER_TAPS][4])
{
    float places[VKB_MAX_TAPS][4] = {{0.0f}};
    uint32_t count = 0;

    for (uint32_t i = 0; i < axis->count; ++i) {
        const float offset = (float)axis->taps[i].offset;
        uint32_t at = 0;
        while (at < count && places[at][0] != offset)
            ++at;
        places[at][0] = offset;
        for (int kernel = 0; kernel < MAX_KERNELS; ++kernel)
            places[at][kernel + 1] += (float)axis->taps[i].weights[kernel];
        count += at == count;
    }
    memcpy(table, places, MAX_FILTER_TAPS * sizeof *table);
    return count;
}

static double furthest(float (*taps)[4])
{
    double distance = 0.0;

    for (int i = 0; i < MAX_FILTER_TAPS; ++i)
        distance = fmax(distance, fabs(taps[i][0]));
    return distance;
}

// The bits of two texels that a linear tap at this place has.
static int32_t taken_at(int32_t window, float place)
{
    const int32_t at = window / 2 - 1 + (int32_t)floorf(place);

    return 1 << at | (place != floorf(place) ? 2 << at : 0);
}

// TAKEN_* of an axis. Positions are between texels, at the centres of these, a quarter beside them,
// or anywhere.
static int32_t taken(float (*taps)[4], int32_t window, const struct vkb_axis *axis)
{
    static const float half[] = {0.5f}, same[] = {0.0f}, twice[] = {0.25f, 0.75f},
                       any[] = {0.0f, 0.99999994f};
    const int32_t ratio = vkb_axis_ratio(axis);
    const float *parts = ratio == EXACT_HALF   ? half
                       : ratio == EXACT_SAME   ? same
                       : ratio == EXACT_DOUBLE ? twice
                                               : any;
    const int count = parts == half || parts == same ? 1 : 2;
    int32_t bits = 0;

    for (int tap = 0; tap < MAX_FILTER_TAPS; ++tap)
        for (int kernel = 0; kernel < MAX_KERNELS; ++kernel)
            for (int part = 0; taps[tap][kernel + 1] != 0.0f && part < count; ++part)
                bits |= taken_at(window, parts[part] + taps[tap][0]) << MAX_WINDOW * kernel;
    return bits;
}

// The row of a filter, and in *count the number of places along an axis.
static struct vkb_pass_row filter_row(const struct vkb_levels *levels,
                                      const struct vkb_filter *filter, uint32_t from, uint32_t to,
                                      uint32_t *count)
{
    struct vkb_pass_row row = vkb_fetching_row(levels, &vkb_shader_filter_frag, from, to);
    struct vkb_filter_params *params = &row.params.filter;
    struct vkb_constants *constants = &row.constants;
    const uint32_t columns = fill_taps(&filter->x, params->taps_x);
    const uint32_t rows = fill_taps(&filter->y, params->taps_y);
    const double distance = fmax(furthest(params->taps_x), furthest(params->taps_y));
    const int32_t window = 2 * (int32_t)ceil(distance) + 2;

    *count = columns > rows ? columns : rows;
    row.block = VKB_BLOCK_filter;
    VKB_SET_TARGET(&row, filter, &levels->graph->images[to]);
    params->coarse = (float)filter->gain;
    params->divisor = (float)filter->divisor;
    if (vkb_is_moved(filter)) {
        params->first_x = vkb_axis_first(&filter->x);
        params->first_y = vkb_axis_first(&filter->y);
        constants->exact = vkb_axis_ratio(&filter->x);
        constants->exact_rows = vkb_axis_ratio(&filter->y);
    }
    constants->tap_count = (int32_t)*count;
    constants->kernels = (int32_t)filter->kernels;
    constants->upsample = filter->x.kind;
    // Taps that are too far apart have no window.
    constants->window = constants->upsample == UPSAMPLE_CUBIC ? 4
                      : window <= MAX_WINDOW                  ? window
                                                              : 0;
    if (constants->upsample == UPSAMPLE_LINEAR && constants->window) {
        constants->taken_x = taken(params->taps_x, window, &filter->x);
        constants->taken_y = taken(params->taps_y, window, &filter->y);
    }
    return row;
}

void vkb_add_mixed_filter_pass(struct vkb_levels *levels, const struct vkb_filter *filter,
                               uint32_t from, uint32_t same_size, double same_size_share,
                               uint32_t to)
{
    struct vkb_filter filters[2] = {*filter};
    const bool adds_image = same_size != VKB_NO_IMAGE;
    uint32_t count;
    struct vkb_pass_row row = filter_row(levels, filter, from, to, &count);

    if (count > MAX_FILTER_TAPS)
        levels->failed =
            levels->failed
            || !vkb_fail(levels->error, VKB_ERROR_GENERAL,
                         "filter: %s has %u places of taps along an axis, more than %d",
                         vkb_graph_label(levels->graph, row.name), count, MAX_FILTER_TAPS);
    row.constants.adds_image = adds_image;
    row.params.filter.same_size = (float)same_size_share;
    vkb_read_at(&row, SLOT_SAME_SIZE, same_size);
    if (adds_image) {
        vkb_filter_begin(levels->graph, same_size, to, &filters[1]);
        filters[1].gain = same_size_share;
    }
    vkb_set_filters(levels, &row, filters, adds_image ? 2 : 1);
    vkb_levels_pass(levels, &row);
}

void vkb_add_filter_pass(struct vkb_levels *levels, const struct vkb_filter *filter, uint32_t from,
                         uint32_t to)
{
    vkb_add_mixed_filter_pass(levels, filter, from, VKB_NO_IMAGE, 0.0, to);
}

void vkb_kawase_down(struct vkb_levels *levels, double offset, uint32_t from, uint32_t to)
{
    const struct vkb_kernel kernels[][2] = {
        {vkb_centre(), vkb_centre()},
        {vkb_sides(0.5 * offset, 0.5, 0.0), vkb_sides(0.5 * offset, 0.5, 0.0)},
    };
    const struct vkb_filter filter = vkb_make_filter(levels->graph, from, to, kernels, 2, 0.5);

    vkb_add_filter_pass(levels, &filter, from, to);
}

void vkb_kawase_up(struct vkb_levels *levels, double offset, uint32_t from, uint32_t to)
{
    const struct vkb_kernel axial = vkb_sides(offset, 1.0, 0.0);
    const struct vkb_kernel kernels[][2] = {
        {axial, vkb_centre()},
        {vkb_centre(), axial},
        {vkb_sides(0.5 * offset, 1.0, 0.0), vkb_sides(0.5 * offset, 2.0, 0.0)},
    };
    struct vkb_filter filter = vkb_make_filter(levels->graph, from, to, kernels, 3, 1.0);

    filter.divisor = 12.0;  // Its inverse is no float.
    filter.enlarges = true;
    vkb_add_filter_pass(levels, &filter, from, to);
}

uint32_t vkb_kawase_rise(struct vkb_levels *levels, double offset)
{
    uint32_t from = levels->downs[levels->count - 1];

    for (uint32_t level = levels->count - 1; level-- > 0;) {
        const uint32_t to = vkb_levels_image(levels, levels->sizes[level], "up_%u", level);
        vkb_kawase_up(levels, offset, from, to);
        from = to;
    }
    return from;
}
