#include "passes/filter.h"

#include <math.h>

struct vkb_pass_row vkb_fetching_row(const struct vkb_levels *levels,
                                     const struct vkb_shader *fragment, uint32_t from, uint32_t to)
{
    struct vkb_pass_row row = vkb_fullscreen_row(levels->graph->images[to].name, fragment, to);

    row.reads[0] = from;
    row.read_count = 1;
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

struct vkb_pass_row vkb_filter_row(const struct vkb_levels *levels, uint32_t from, uint32_t to,
                                   double gain)
{
    struct vkb_pass_row row = vkb_fetching_row(levels, &vkb_shader_filter_frag, from, to);

    row.block = VKB_BLOCK_filter;
    VKB_SET_TARGET(&row, filter, &levels->graph->images[to]);
    row.params.filter.coarse = (float)gain;
    row.params.filter.divisor = 1.0f;
    row.constants.upsample = UPSAMPLE_LINEAR;
    // Every binding of the shader must be filled, also one that this variant does not read.
    row.reads[1] = from;
    row.read_count = 2;
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

static uint32_t add_taps(float (*taps)[4], uint32_t count, int kernel, struct vkb_side_taps added)
{
    count = add_tap(taps, count, kernel, -added.distance, added.side);
    count = add_tap(taps, count, kernel, 0.0, added.middle);
    return add_tap(taps, count, kernel, added.distance, added.side);
}

// The taps so far; those beyond have no weight.
static uint32_t count_taps(float (*taps)[4])
{
    uint32_t count = MAX_FILTER_TAPS;

    while (count > 0 && taps[count - 1][1] == 0.0f && taps[count - 1][2] == 0.0f
           && taps[count - 1][3] == 0.0f)
        --count;
    return count;
}

void vkb_filter_add(struct vkb_pass_row *row, int kernel, struct vkb_side_taps x,
                    struct vkb_side_taps y)
{
    struct vkb_filter_params *params = &row->params.filter;
    const uint32_t columns = add_taps(params->taps_x, count_taps(params->taps_x), kernel, x);
    const uint32_t rows = add_taps(params->taps_y, count_taps(params->taps_y), kernel, y);

    row->constants.taps = (int32_t)(columns > rows ? columns : rows);
    row->constants.kernels = kernel + 1;
}

void vkb_filter_add_own(struct vkb_pass_row *row, uint32_t own, double share)
{
    if (own == VKB_NO_IMAGE)
        return;
    row->reads[1] = own;
    row->constants.add_own = true;
    row->params.filter.own = (float)share;
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

void vkb_filter_end(struct vkb_levels *levels, struct vkb_pass_row *row)
{
    struct vkb_filter_params *params = &row->params.filter;
    const double rows = furthest(params->taps_y);
    const int32_t window = 2 * (int32_t)ceil(fmax(furthest(params->taps_x), rows)) + 2;

    row->constants.window = row->constants.upsample == UPSAMPLE_CUBIC ? 4
                          : window <= MAX_WINDOW                      ? window
                                                                      : 0;
    if (row->constants.upsample == UPSAMPLE_LINEAR && row->constants.window) {
        const struct vkb_image_row *source = &levels->graph->images[row->reads[0]];
        const struct vkb_image_row *target = &levels->graph->images[row->targets[0]];
        row->constants.taken_x = taken(params->taps_x, window, source->width, target->width);
        row->constants.taken_y = taken(params->taps_y, window, source->height, target->height);
    }
    vkb_levels_pass(levels, row);
}

void vkb_kawase_down(struct vkb_levels *levels, double offset, uint32_t from, uint32_t to)
{
    const struct vkb_side_taps centre = {0.0, 0.0, 1.0};
    const struct vkb_side_taps sides = {0.5 * offset, 0.5, 0.0};
    struct vkb_pass_row row = vkb_filter_row(levels, from, to, 0.5);

    vkb_filter_add(&row, 0, centre, centre);
    vkb_filter_add(&row, 1, sides, sides);
    vkb_filter_end(levels, &row);
}

void vkb_kawase_up(struct vkb_levels *levels, double offset, uint32_t from, uint32_t to)
{
    const struct vkb_side_taps centre = {0.0, 0.0, 1.0}, axial = {offset, 1.0, 0.0};
    const struct vkb_side_taps diagonal = {0.5 * offset, 1.0, 0.0};
    const struct vkb_side_taps twice = {0.5 * offset, 2.0, 0.0};
    struct vkb_pass_row row = vkb_filter_row(levels, from, to, 1.0);

    vkb_filter_add(&row, 0, axial, centre);
    vkb_filter_add(&row, 1, centre, axial);
    vkb_filter_add(&row, 2, diagonal, twice);
    // Its inverse is no float.
    row.params.filter.divisor = 12.0f;
    vkb_filter_end(levels, &row);
}

uint32_t vkb_kawase_rise(struct vkb_levels *levels, double offset)
{
    uint32_t from = levels->downs[levels->count - 1];

    for (uint32_t level = levels->count - 1; level-- > 0;) {
        const uint32_t to = vkb_levels_image(levels, "up_%u", level, levels->sizes[level]);
        vkb_kawase_up(levels, offset, from, to);
        from = to;
    }
    return from;
}
