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

// Of taps at the same place there is one.
static uint32_t add_tap(float (*taps)[4], uint32_t count, int kernel, double offset, double weight)
{
    uint32_t at = 0;

    if (weight == 0.0)
        return count;
    while (at < count && taps[at][0] != (float)offset)
        ++at;
    taps[at][0] = (float)offset;
    taps[at][kernel + 1] += (float)weight;
    return at < count ? count : count + 1;
}

// Fills the table of an axis, and counts the kernels. Returns the number of taps, of which the
// table holds MAX_FILTER_TAPS.
static uint32_t fill_taps(const struct vkb_taps *filter, int axis, float table[MAX_FILTER_TAPS][4],
                          int32_t *kernels)
{
    float taps[3 * MAX_KERNELS][4] = {{0.0f}};
    uint32_t count = 0;

    for (int kernel = 0; kernel < MAX_KERNELS; ++kernel) {
        const struct vkb_side_taps *added = &filter->kernels[kernel][axis];
        count = add_tap(taps, count, kernel, -added->distance, added->side);
        count = add_tap(taps, count, kernel, 0.0, added->middle);
        count = add_tap(taps, count, kernel, added->distance, added->side);
        if (added->side != 0.0 || added->middle != 0.0)
            *kernels = kernel + 1;
    }
    memcpy(table, taps, MAX_FILTER_TAPS * sizeof *table);
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
static int32_t taken(float (*taps)[4], int32_t window, uint32_t source, uint32_t target)
{
    static const float half[] = {0.5f}, same[] = {0.0f}, twice[] = {0.25f, 0.75f},
                       any[] = {0.0f, 0.99999994f};
    const float *parts = source == 2 * target ? half
                       : source == target     ? same
                       : 2 * source == target ? twice
                                              : any;
    const int count = parts == half || parts == same ? 1 : 2;
    int32_t bits = 0;

    for (int tap = 0; tap < MAX_FILTER_TAPS; ++tap)
        for (int kernel = 0; kernel < MAX_KERNELS; ++kernel)
            for (int part = 0; taps[tap][kernel + 1] != 0.0f && part < count; ++part)
                bits |= taken_at(window, parts[part] + taps[tap][0]) << MAX_WINDOW * kernel;
    return bits;
}

void vkb_add_filter(struct vkb_levels *levels, const struct vkb_taps *filter, uint32_t from,
                    uint32_t to)
{
    struct vkb_pass_row row = vkb_fetching_row(levels, &vkb_shader_filter_frag, from, to);
    struct vkb_filter_params *params = &row.params.filter;
    struct vkb_constants *constants = &row.constants;
    const uint32_t columns = fill_taps(filter, 0, params->taps_x, &constants->kernels);
    const uint32_t rows = fill_taps(filter, 1, params->taps_y, &constants->kernels);
    const struct vkb_image_row *source = &levels->graph->images[from];
    const struct vkb_image_row *target = &levels->graph->images[to];
    const double distance = fmax(furthest(params->taps_x), furthest(params->taps_y));
    const int32_t window = 2 * (int32_t)ceil(distance) + 2;

    if (columns > MAX_FILTER_TAPS || rows > MAX_FILTER_TAPS)
        levels->failed =
            levels->failed
            || !vkb_fail(levels->error, VKB_ERROR_GENERAL,
                         "filter: %s has %u x %u places of taps, more than %d",
                         vkb_graph_label(levels->graph, row.name), columns, rows, MAX_FILTER_TAPS);
    row.block = VKB_BLOCK_filter;
    VKB_SET_TARGET(&row, filter, target);
    params->coarse = (float)filter->gain;
    params->divisor = filter->divisor != 0.0 ? (float)filter->divisor : 1.0f;
    params->own = (float)filter->own_share;
    constants->taps = (int32_t)(columns > rows ? columns : rows);
    constants->upsample = filter->upsample ? filter->upsample : UPSAMPLE_LINEAR;
    constants->add_own = filter->adds_own;
    // Taps that are too far apart have no window.
    constants->window = constants->upsample == UPSAMPLE_CUBIC ? 4
                      : window <= MAX_WINDOW                  ? window
                                                              : 0;
    if (constants->upsample == UPSAMPLE_LINEAR && constants->window) {
        constants->taken_x = taken(params->taps_x, window, source->width, target->width);
        constants->taken_y = taken(params->taps_y, window, source->height, target->height);
    }
    vkb_read_at(&row, SLOT_OWN, filter->adds_own ? filter->own : VKB_NO_IMAGE);
    vkb_levels_pass(levels, &row);
}

void vkb_kawase_down(struct vkb_levels *levels, double offset, uint32_t from, uint32_t to)
{
    const struct vkb_side_taps centre = {0.0, 0.0, 1.0}, sides = {0.5 * offset, 0.5, 0.0};
    const struct vkb_taps taps = {{{centre, centre}, {sides, sides}}, .gain = 0.5};

    vkb_add_filter(levels, &taps, from, to);
}

void vkb_kawase_up(struct vkb_levels *levels, double offset, uint32_t from, uint32_t to)
{
    const struct vkb_side_taps centre = {0.0, 0.0, 1.0}, axial = {offset, 1.0, 0.0};
    const struct vkb_side_taps diagonal = {0.5 * offset, 1.0, 0.0};
    const struct vkb_side_taps twice = {0.5 * offset, 2.0, 0.0};
    const struct vkb_taps taps = {
        {{axial, centre}, {centre, axial}, {diagonal, twice}},
        .gain = 1.0,
        // Its inverse is no float.
        .divisor = 12.0,
    };

    vkb_add_filter(levels, &taps, from, to);
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
