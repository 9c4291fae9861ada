// Fourier transforms of complete lines in shared memory, which a GPU has close to its arithmetic:
// all stages along an axis are one pass, and along columns those forth, the product and those back.
#include "passes/fft.h"
#include "variants/variant.h"

#include <string.h>

// Of a line in a workgroup.
struct group {
    uint32_t radices[VKB_FFT_STAGES];
    uint32_t size;       // invocations for each line
    uint32_t lines;      // of a workgroup
    uint32_t exchanged;  // floats of an element at once
};

// A workgroup of short lines has several: of fewer invocations too few would run at a time.
enum { USUAL_INVOCATIONS = 128, MOST_LINES = 16 };

static const enum vkb_shader shaders[VKB_FORMAT_COUNT] = VKB_BY_FORMAT(fft_lines_comp);

static bool group_fits(const struct vkb_device *device, const struct group *group, uint32_t length)
{
    const VkPhysicalDeviceLimits *limits = &device->limits;
    const uint64_t floats =
        (uint64_t)group->lines * group->exchanged * (length + length / 32) + group->size + 1;

    return group->size <= limits->maxComputeWorkGroupSize[1]
        && group->lines <= limits->maxComputeWorkGroupSize[0]
        && group->size * group->lines <= limits->maxComputeWorkGroupInvocations
        && floats * sizeof(float) <= limits->maxComputeSharedMemorySize;
}

// False: the device cannot hold such a line.
static bool make_group(const struct vkb_device *device, uint32_t length, struct group *group)
{
    uint32_t least = length;

    *group = (struct group){.lines = 1, .exchanged = 4};
    if (!vkb_fft_group_radices(length, group->radices))
        return false;
    for (uint32_t i = 0; i < VKB_FFT_STAGES; ++i)
        if (group->radices[i] > 1 && group->radices[i] < least)
            least = group->radices[i];
    group->size = length / least;
    while (group->exchanged > 1 && !group_fits(device, group, length))
        group->exchanged /= 2;
    if (!group_fits(device, group, length))
        return false;
    while (group->lines < MOST_LINES && group->size * group->lines < USUAL_INVOCATIONS) {
        group->lines *= 2;
        if (!group_fits(device, group, length)) {
            group->lines /= 2;
            break;
        }
    }
    return true;
}

static bool is_stage(const struct vkb_pass_row *pass)
{
    return pass->block == VKB_BLOCK_fft;
}

// Whether the device can hold the lines of all transforms.
static bool holds_lines(const struct vkb_variant_choice *choice)
{
    struct group group;
    bool holds = true;

    for (uint32_t i = 0; holds && i < choice->plain.pass_count; ++i)
        if (is_stage(&choice->plain.passes[i]))
            holds = make_group(choice->device, (uint32_t)choice->plain.passes[i].params.fft.padded,
                               &group);
    return holds;
}

static bool multiplies(const struct vkb_pass_row *pass)
{
    return pass->constants.stage == STAGE_GREY || pass->constants.stage == STAGE_COLOURS;
}

// The row for all stages along an axis, from `first` to before `end`.
static struct vkb_pass_row make_row(const struct vkb_variant_choice *choice,
                                    const struct vkb_pass_row *first,
                                    const struct vkb_pass_row *end)
{
    const struct vkb_graph *graph = choice->graph;
    const struct vkb_pass_row *last = end - 1;
    const bool horizontal = first->constants.direction == DIRECTION_HORIZONTAL;
    struct vkb_pass_row row;
    struct group group;

    memcpy(&row, first, sizeof row);
    if (first->constants.stage != STAGE_FIRST)
        row.reads[0] = row.reads[1] = graph->passes[graph->pass_count - 1].targets[0];
    // Columns are transformed in place.
    row.targets[0] = first->constants.inverse ? last->targets[0]
                   : horizontal               ? first->targets[0]
                                              : row.reads[0];
    row.shader = shaders[graph->images[row.reads[0]].format];
    row.constants.rotated = row.constants.radix_a = row.constants.radix_b = 0;
    if (first->constants.inverse)
        row.constants.stage = STAGE_LAST;
    for (const struct vkb_pass_row *pass = first; pass < end; ++pass)
        if (multiplies(pass)) {
            row.constants.stage = pass->constants.stage;
            row.reads[1] = pass->reads[1];
            row.params.fft.row_length = pass->params.fft.row_length;
        }
    row.params.fft.kept = last->params.fft.kept;
    row.params.fft.limit = last->params.fft.limit;
    if (!horizontal)
        row.params.fft.across = (int)graph->images[row.targets[0]].width;
    (void)make_group(choice->device, (uint32_t)row.params.fft.padded, &group);
    row.constants.radix_1 = (int32_t)group.radices[0];
    row.constants.radix_2 = (int32_t)group.radices[1];
    row.constants.radix_3 = (int32_t)group.radices[2];
    row.constants.radix_4 = (int32_t)group.radices[3];
    row.constants.group_width = (int32_t)group.lines;
    row.constants.group_height = (int32_t)group.size;
    row.constants.exchanged = (int32_t)group.exchanged;
    row.groups_width = ((uint32_t)row.params.fft.across + group.lines - 1) / group.lines;
    row.groups_height = 1;
    return row;
}

// An image of spectra has those of the channels, which are symmetric: half the frequencies, twice.
static void hold_spectra(struct vkb_graph *graph, uint32_t image, uint32_t row_length)
{
    graph->images[image].width = 2 * (row_length / 2 + 1);
}

bool vkb_add_lines(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                   bool *fits, struct vkb_error *error)
{
    const struct vkb_pass_row *all = choice->plain.passes, *end = pass + 1;
    struct vkb_pass_row row;

    *fits = (is_stage(pass) || pass->block == VKB_BLOCK_fft_kernel) && holds_lines(choice);
    if (!*fits)
        return true;
    if (!is_stage(pass)) {
        memcpy(&row, pass, sizeof row);
        row.params.fft_kernel.grey = 0;
        hold_spectra(choice->graph, row.targets[0], (uint32_t)row.params.fft_kernel.padded_x);
        return vkb_graph_add_pass(choice->graph, &row, error);
    }
    // The first stage along an axis stands for all.
    if (pass > all && is_stage(pass - 1)
        && pass[-1].constants.direction == pass->constants.direction)
        return true;
    while (end < all + choice->plain.pass_count && is_stage(end)
           && end->constants.direction == pass->constants.direction)
        ++end;
    if (pass->constants.stage == STAGE_FIRST)
        hold_spectra(choice->graph, pass->targets[0], (uint32_t)pass->params.fft.padded);
    row = make_row(choice, pass, end);
    return vkb_graph_add_pass(choice->graph, &row, error);
}
