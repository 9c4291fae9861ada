#include "passes/fft.h"

#include <string.h>

// The radices of a stage: products of two that the shader has, up to FFT_MAX_RADIX.
static const uint32_t radices[] = {16, 15, 12, 10, 9, 8, 6, 5, 4, 3, 2, 1};

enum { RADIX_COUNT = sizeof radices / sizeof radices[0] };

static bool is_smooth(uint32_t length)
{
    for (uint32_t factor = 2; factor <= 5; ++factor)
        while (length % factor == 0)
            length /= factor;
    return length == 1;
}

// The largest radix for a length. Short lines share the pipelines of a few small radices.
static uint32_t most_radix(uint32_t length)
{
    return length <= 64 ? 8 : FFT_MAX_RADIX;
}

// Splits the length into so many stages, the longest first, whose radices have the least sum:
// registers for many elements are slow. `first` is the index of the largest radix.
static bool split(uint32_t length, uint32_t first, uint32_t stages, uint32_t *found)
{
    uint32_t least = UINT32_MAX, rest[VKB_FFT_STAGES];

    for (uint32_t i = first; i < RADIX_COUNT; ++i) {
        uint32_t sum = radices[i];
        if (length % sum != 0)
            continue;
        if (stages == 1 ? sum != length : !split(length / sum, i, stages - 1, rest))
            continue;
        for (uint32_t j = 0; stages > 1 && j < stages - 1; ++j)
            sum += rest[j];
        if (sum >= least)
            continue;
        least = sum;
        found[0] = radices[i];
        memcpy(found + 1, rest, (stages - 1) * sizeof *found);
    }
    return least != UINT32_MAX;
}

// No line of the length has fewer, whatever its factors.
static uint32_t least_stages(uint32_t length)
{
    uint32_t stages = 1;

    for (uint32_t reach = FFT_MAX_RADIX; reach < length; reach *= FFT_MAX_RADIX)
        ++stages;
    return stages;
}

struct vkb_fft_line vkb_fft_line(uint32_t least)
{
    // A line that is too long for the stages is too long for images, too, whose sizes are checked
    // when the graph is complete.
    struct vkb_fft_line best = {.length = least, .stage_count = 1, .radices = {least, 1, 1, 1}};
    uint64_t best_cost = UINT64_MAX;

    // A power of two is among these.
    for (uint32_t length = least; length <= 2 * least; ++length) {
        struct vkb_fft_line line = {.length = length, .radices = {1, 1, 1, 1}};
        uint32_t first = 0;
        bool found = false;
        // Longer ones take at least as long.
        if ((uint64_t)length * (least_stages(length) + 1) >= best_cost)
            break;
        while (radices[first] > most_radix(length))
            ++first;
        while (is_smooth(length) && !found && line.stage_count < VKB_FFT_STAGES) {
            ++line.stage_count;
            found = split(length, first, line.stage_count, line.radices);
        }
        // Each stage loads and stores all elements.
        const uint64_t cost = (uint64_t)length * (line.stage_count + 1);
        if (found && cost < best_cost) {
            best = line;
            best_cost = cost;
        }
    }
    return best;
}

bool vkb_fft_group_radices(uint32_t length, uint32_t *found)
{
    if (!is_smooth(length))
        return false;
    for (uint32_t i = 0; i < VKB_FFT_STAGES; ++i)
        found[i] = 1;
    for (uint32_t stages = 1; stages <= VKB_FFT_STAGES; ++stages)
        if (split(length, 0, stages, found))
            return true;
    return false;
}

static const struct vkb_shader *const shaders[VKB_FORMAT_COUNT] = VKB_BY_FORMAT(fft_image);

static uint32_t groups(uint32_t invocations, uint32_t side)
{
    return (invocations + side - 1) / side;
}

struct vkb_pass_row vkb_fft_row(const struct vkb_graph *graph, const struct vkb_fft_stage *stage)
{
    const struct vkb_fft_axis *axis = stage->axis;
    const bool horizontal = axis->direction == DIRECTION_HORIZONTAL;
    const uint32_t radix = axis->line.radices[stage->number];
    const uint32_t count = axis->line.length / radix;
    const struct vkb_image_row *target = &graph->images[stage->to];
    struct vkb_pass_row row =
        vkb_fullscreen_row(stage->name, shaders[graph->images[stage->from].format], stage->to);
    struct vkb_fft_params *params = &row.params.fft;

    row.geometry = VKB_GEOMETRY_DISPATCH;
    row.vertex = NULL;
    row.reading = VKB_READING_LOADED;
    row.variant = "dispatch";
    row.block_width = row.block_height = 1;
    // Neighbours along a row: places in memory that are far apart are few.
    row.constants.group_width =
        !horizontal || count >= FFT_INVOCATIONS ? FFT_INVOCATIONS : FFT_ROW_COLUMNS;
    row.constants.group_height = FFT_INVOCATIONS / row.constants.group_width;
    row.groups_width =
        groups(horizontal ? count : stage->lines, (uint32_t)row.constants.group_width);
    row.groups_height =
        groups(horizontal ? stage->lines : count, (uint32_t)row.constants.group_height);
    vkb_read_only(&row, stage->from);
    vkb_read_at(&row, SLOT_ADDED, VKB_NO_IMAGE);
    row.constants.direction = axis->direction;
    row.constants.inverse = stage->inverse;
    row.constants.padded = stage->padded;
    row.constants.boundary = stage->padded ? (int32_t)axis->boundary : 0;
    row.constants.radix_1 = (int32_t)radix;
    row.block = VKB_BLOCK_fft;
    params->count = (int)count;
    params->across = (int)stage->lines;
    params->step = (int)axis->line.length;
    for (uint32_t i = 0; i <= stage->number; ++i)
        params->step /= (int)axis->line.radices[i];
    row.constants.rotated = params->step > 1;
    params->kept = (int)(horizontal ? target->width : target->height);
    params->padded = (int)axis->line.length;
    params->extent = (int)axis->extent;
    params->first = stage->padded ? (int)axis->first : 0;
    params->turn = (int)(axis->extent + axis->before);
    return row;
}

void vkb_fft_multiply(const struct vkb_fft_axis *rows, const struct vkb_fft_axis *columns,
                      uint32_t spectrum, bool grey, bool conjugate, struct vkb_pass_row *row)
{
    const uint32_t *row_radices = rows->line.radices;
    const uint32_t last = row_radices[rows->line.stage_count - 1];
    uint32_t blocks[VKB_FFT_STAGES];

    memcpy(blocks, columns->line.radices, sizeof blocks);
    blocks[columns->line.stage_count - 1] = 1;
    row->reads[SLOT_SPECTRUM] = spectrum;
    row->constants.stage = grey ? STAGE_GREY : STAGE_PRODUCT;
    row->params.fft.kernel_sign = conjugate ? -1.0f : 1.0f;
    if (grey)
        return;
    row->params.fft.row_length = (int)rows->line.length;
    row->params.fft.row_a = (int)row_radices[0];
    row->params.fft.row_b = (int)row_radices[1];
    row->params.fft.row_c = (int)row_radices[2];
    row->params.fft.row_d = (int)row_radices[3];
    row->params.fft.row_last = (int)last;
    row->params.fft.block_a = (int)blocks[0];
    row->params.fft.block_b = (int)blocks[1];
    row->params.fft.block_c = (int)blocks[2];
    // Columns with frequencies of up to half the rows' length, which have the others in hand.
    row->params.fft.across = (int)(rows->line.length / last * (last / 2 + 1));
    row->groups_width =
        groups((uint32_t)row->params.fft.across, (uint32_t)row->constants.group_width);
}
