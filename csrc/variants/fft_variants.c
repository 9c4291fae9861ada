// Fourier transforms of complete lines: in shared memory, which a GPU has close to its arithmetic,
// or on the host, where images are in its memory. All stages along an axis are one pass, and along
// columns those forth, the product and those back.
#include "passes/fft.h"
#include "passes/host_fft.h"
#include "variants/variant.h"

#include <stdio.h>
#include <string.h>

// Of a line in a workgroup.
struct group {
    uint32_t radices[VKB_FFT_STAGES];
    uint32_t size;   // invocations for each line
    uint32_t lines;  // of a workgroup
    uint32_t pitch;  // floats of a line in shared memory
};

enum {
    // A workgroup of short lines has several: of fewer invocations too few would run at a time.
    USUAL_INVOCATIONS = 128,
    MAX_LINES = 16,
    // Of more, two workgroups would not have registers enough: a GPU has 65536 for all.
    MAX_INVOCATIONS = 640,
};

static const VkFormatFeatureFlags spectrum_features =
    VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT | VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT;

// The most floats of a line between two stages, on its way forth and back.
static uint32_t find_pitch(const uint32_t *radices, uint32_t length)
{
    uint32_t most = length;

    for (int back = 0; back < 2; ++back)
        for (uint32_t i = 0, step = 1; i < VKB_FFT_STAGES; ++i) {
            const uint32_t radix = radices[back ? VKB_FFT_STAGES - 1 - i : i];
            const uint32_t blocks = length / (step * radix);
            const uint32_t floats = length + blocks * FFT_PADDING(step, radix, length);
            most = floats > most ? floats : most;
            step *= radix;
        }
    return most;
}

static bool group_fits(const struct vkb_device *device, const struct group *group)
{
    const VkPhysicalDeviceLimits *limits = &device->limits;
    const uint64_t floats = (uint64_t)group->lines * group->pitch + 1;

    // Any device has MAX_LINES along an axis.
    return group->size <= limits->maxComputeWorkGroupSize[0]
        && group->size <= limits->maxComputeWorkGroupSize[1]
        && group->size * group->lines <= limits->maxComputeWorkGroupInvocations
        && floats * sizeof(float) <= limits->maxComputeSharedMemorySize;
}

// Of a line of `length` complex numbers. False: the device cannot hold such a line.
static bool make_group(const struct vkb_device *device, uint32_t length, struct group *group)
{
    uint32_t least = length;

    *group = (struct group){.lines = 1};
    if (!vkb_fft_group_radices(length, group->radices))
        return false;
    for (uint32_t i = 0; i < VKB_FFT_STAGES; ++i)
        if (group->radices[i] > 1 && group->radices[i] < least)
            least = group->radices[i];
    group->size = length / least;
    group->pitch = find_pitch(group->radices, length);
    if (!group_fits(device, group))
        return false;
    while (group->lines < MAX_LINES && group->size * group->lines < USUAL_INVOCATIONS) {
        group->lines *= 2;
        if (!group_fits(device, group)) {
            group->lines /= 2;
            break;
        }
    }
    return true;
}

// Of a column of so many elements, or of a row of so many pixels, which is a line of half the
// length.
static bool make_axis_group(const struct vkb_device *device, bool rows, uint32_t length,
                            struct group *group)
{
    return rows ? length % 2 == 0 && make_group(device, length / 2, group)
                : make_group(device, length, group);
}

// The length itself, or the next one up to an eighth longer whose lines have fewer invocations. On
// an H200, columns of 4608 elements take 0.53 ms where 4320 take 0.82 (2026-11-30).
static uint32_t longer_length(const struct vkb_device *device, bool rows, uint32_t length)
{
    struct group group;

    for (uint32_t each = length; each <= length + length / 8; ++each)
        if (make_axis_group(device, rows, each, &group) && group.size <= MAX_INVOCATIONS)
            return each;
    return length;
}

// Finds the lines of the convolution that the pass is of. A period cannot be longer. Images have
// the spectra of four channels.
static const struct vkb_lines *find_lines(struct vkb_variant_choice *choice,
                                          const struct vkb_pass_row *pass)
{
    const struct vkb_device *device = choice->device;
    const struct vkb_transform *of = &pass->transform;
    struct vkb_lines *lines = &choice->lines;
    struct group group;

    if (lines->width == of->width && lines->height == of->height
        && lines->pads_rows == of->pads_rows && lines->pads_columns == of->pads_columns)
        return lines;
    *lines = (struct vkb_lines){
        .width = of->width,
        .height = of->height,
        .pads_rows = of->pads_rows,
        .pads_columns = of->pads_columns,
        .x = of->pads_rows ? longer_length(device, true, of->width) : of->width,
        .y = of->pads_columns ? longer_length(device, false, of->height) : of->height,
    };
    lines->held = make_axis_group(device, true, lines->x, &group)
               && make_axis_group(device, false, lines->y, &group)
               && 4 * (lines->x / 2 + 1) <= device->max_side && device->extended_formats
               && vkb_device_supports(device, VKB_FORMAT_RG32_FLOAT, spectrum_features);
    return lines;
}

static bool multiplies(const struct vkb_pass_row *pass)
{
    return pass->constants.stage == STAGE_PRODUCT || pass->constants.stage == STAGE_GREY;
}

// What comes back is weighted by its last stage.
static void copy_weighing(struct vkb_pass_row *row, const struct vkb_pass_row *last)
{
    row->constants.weighted = last->constants.weighted;
    row->constants.adds_image = last->constants.adds_image;
    row->reads[SLOT_WEIGHTS] = last->reads[SLOT_WEIGHTS];
    row->reads[SLOT_ADDED] = last->reads[SLOT_ADDED];
    row->params.fft.weight = last->params.fft.weight;
    row->params.fft.share = last->params.fft.share;
    row->params.fft.before_x = last->params.fft.before_x;
    row->params.fft.before_y = last->params.fft.before_y;
}

// Gives a row the product of one of the passes that it stands for. False: there is none.
static bool copy_product(struct vkb_pass_row *row, const struct vkb_pass_row *first,
                         const struct vkb_pass_row *end)
{
    while (first < end && !multiplies(first))
        ++first;
    if (first == end)
        return false;
    row->constants.stage = first->constants.stage;
    row->reads[SLOT_SPECTRUM] = first->reads[SLOT_SPECTRUM];
    row->params.fft.kernel_sign = first->params.fft.kernel_sign;
    return true;
}

// Each channel has so many texels in a row of an image of spectra.
static uint32_t count_frequencies(const struct vkb_variant_choice *choice)
{
    return choice->lines.x / 2 + 1;
}

// Has an image hold the spectra of all channels of a pass.
static void hold_spectra(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                         uint32_t image)
{
    struct vkb_image_row *row = &choice->graph->images[image];

    row->format = VKB_FORMAT_RG32_FLOAT;
    row->width = pass->transform.channels * count_frequencies(choice);
}

// The images of a row for all stages along an axis, from `first` to before `end`.
static void set_images(const struct vkb_variant_choice *choice, const struct vkb_pass_row *first,
                       const struct vkb_pass_row *end, struct vkb_pass_row *row)
{
    const struct vkb_graph *graph = choice->graph;
    const struct vkb_pass_row *last = end - 1;
    const bool rows = first->constants.direction == DIRECTION_HORIZONTAL;

    vkb_read_at(row, SLOT_ADDED_SPECTRUM, VKB_NO_IMAGE);
    row->targets[0] = first->targets[0];
    if (first->constants.inverse) {
        row->targets[0] = last->targets[0];
        copy_weighing(row, last);
    }
    // Columns may have been transformed in place.
    if (first->constants.inverse && rows)
        row->reads[SLOT_SOURCE] = graph->passes[graph->pass_count - 1].targets[0];
    if (!rows) {
        row->reads[SLOT_ADDED_SPECTRUM] = row->reads[SLOT_ADDED];
        row->reads[SLOT_ADDED] = VKB_NO_IMAGE;
    }
    // Columns are transformed in place, forth and back.
    if (copy_product(row, first, end) && !first->constants.inverse)
        row->targets[0] = row->reads[SLOT_SOURCE];
}

// How many elements of a butterfly have one of the first `pixels` of the row, or of the first
// elements of the column. The elements are a radix-th part of the line apart.
static uint32_t count_parts(const struct vkb_pass_row *row, uint32_t radix, int32_t pixels)
{
    const uint32_t adjacent = (uint32_t)row->params.fft.padded / radix;
    const uint32_t parts = ((uint32_t)pixels + adjacent - 1) / adjacent;

    return parts < radix ? parts : radix;
}

// Leaves out what is only padding on the way forth, and what is not kept on the way back.
static void set_parts(const struct vkb_pass_row *first, const struct group *group,
                      struct vkb_pass_row *row)
{
    const struct vkb_fft_params *params = &first->params.fft;
    const bool zeros = first->constants.padded && first->constants.boundary == BOUNDARY_ZERO;
    const bool returns = first->constants.inverse || multiplies(row);

    row->constants.filled = row->constants.kept_results = FFT_MAX_RADIX;
    // Behind the last texel are zeros.
    if (zeros && !first->constants.inverse)
        row->constants.filled =
            (int32_t)count_parts(row, group->radices[0], params->first + params->extent);
    if (returns)
        row->constants.kept_results =
            (int32_t)count_parts(row, group->radices[0], row->params.fft.kept);
}

static const struct vkb_shader *const first_shaders[VKB_FORMAT_COUNT] =
    VKB_BY_FORMAT(fft_lines_image);

// The row for all stages along an axis, from `first` to before `end`.
static struct vkb_pass_row make_row(const struct vkb_variant_choice *choice,
                                    const struct vkb_pass_row *first,
                                    const struct vkb_pass_row *end)
{
    const struct vkb_graph *graph = choice->graph;
    const bool rows = first->constants.direction == DIRECTION_HORIZONTAL;
    const bool makes_pixels = rows && first->constants.inverse;
    const uint32_t length = rows ? choice->lines.x : choice->lines.y;
    const uint32_t frequencies = count_frequencies(choice);
    struct vkb_pass_row row;
    struct group group;

    memcpy(&row, first, sizeof row);
    set_images(choice, first, end, &row);
    row.shader = row.constants.stage == STAGE_FIRST
                   ? first_shaders[graph->images[row.reads[SLOT_SOURCE]].format]
                   : &vkb_shader_fft_lines_spectra;
    if (makes_pixels)
        row.constants.stage = STAGE_LAST;
    row.constants.rotated = 0;
    const struct vkb_image_row *source = &graph->images[row.reads[SLOT_SOURCE]];
    struct vkb_image_row *target = &graph->images[row.targets[0]];
    // Without a product, columns forth and back have images of their own.
    if (!rows && target != source) {
        hold_spectra(choice, first, row.targets[0]);
        target->height = first->constants.inverse ? (uint32_t)end[-1].params.fft.kept : length;
    }
    row.constants.channels = (int32_t)first->transform.channels;
    row.params.fft.frequencies = (int)frequencies;
    row.params.fft.padded = (int)length;
    row.params.fft.kept = rows ? end[-1].params.fft.kept : (int)target->height;
    row.params.fft.across = makes_pixels ? first->params.fft.across
                          : !rows        ? row.constants.channels * (int)frequencies
                          : row.constants.stage == STAGE_FIRST
                              ? first->params.fft.across * row.constants.channels
                              : (int)target->height * row.constants.channels;
    (void)make_axis_group(choice->device, rows, length, &group);
    row.constants.radix_1 = (int32_t)group.radices[0];
    row.constants.radix_2 = (int32_t)group.radices[1];
    row.constants.radix_3 = (int32_t)group.radices[2];
    row.constants.radix_4 = (int32_t)group.radices[3];
    row.constants.pitch = (int32_t)group.pitch;
    set_parts(first, &group, &row);
    const uint32_t groups = ((uint32_t)row.params.fft.across + group.lines - 1) / group.lines;
    row.constants.group_width = (int32_t)(rows ? group.size : group.lines);
    row.constants.group_height = (int32_t)(rows ? group.lines : group.size);
    row.groups_width = rows ? 1 : groups;
    row.groups_height = rows ? groups : 1;
    return row;
}

// Has the first stage of a transpose read the cotangents of a composite.
static void read_composite(const struct vkb_variant_choice *choice, struct vkb_pass_row *row)
{
    const struct vkb_graph *graph = choice->graph;
    struct vkb_pass_row fused;

    memcpy(&fused, row, sizeof fused);
    fused.params.fft.gain = vkb_read_composite(&choice->plain, SLOT_SOURCE, SLOT_THROUGH, &fused);
    if (!fused.constants.through_composite
        || !vkb_has_format_of(graph, fused.reads[SLOT_SOURCE], fused.reads[SLOT_THROUGH]))
        return;
    fused.shader = first_shaders[graph->images[fused.reads[SLOT_SOURCE]].format];
    fused.gains_if_finite = true;
    memcpy(row, &fused, sizeof *row);
}

// The row that puts the kernel to its places, in lines of the lengths that are transformed.
static struct vkb_pass_row make_placing(const struct vkb_variant_choice *choice,
                                        const struct vkb_pass_row *pass)
{
    const uint32_t x = choice->lines.x, y = choice->lines.y;
    struct vkb_pass_row row;

    memcpy(&row, pass, sizeof row);
    row.params.fft_kernel.channels = (int)pass->transform.channels;
    row.params.fft_kernel.padded_x = (int)x;
    row.params.fft_kernel.padded_y = (int)y;
    row.params.fft_kernel.gain = (float)(1.0 / ((double)x * y));
    hold_spectra(choice, pass, pass->targets[0]);
    choice->graph->images[row.targets[0]].height = y;
    return row;
}

// The products of complete spectra: each texel has a frequency of a channel.
static bool add_products(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    struct vkb_pass_row row;

    memcpy(&row, pass, sizeof row);
    if (row.constants.stage == STAGE_GREY)
        row.params.products.frequencies = (int)count_frequencies(choice);
    row.constants.stage = STAGE_GREY;
    hold_spectra(choice, pass, pass->targets[0]);
    choice->graph->images[row.targets[0]].height = choice->lines.y;
    return vkb_add_fullscreen_variant(choice, &row);
}

// After the rows and the columns in place that transform a glow, adds both once more, with rows
// that read the image itself. The passes of `camera_lens` take 1.27 ms in place of 1.36 (3840 x
// 2160, H200, 2026-11-30).
static bool add_from_image(struct vkb_variant_choice *choice, const struct vkb_pass_row *columns)
{
    const struct vkb_graph *graph = choice->graph;
    const uint32_t count = graph->pass_count;
    struct vkb_pass_row row;

    if (choice->failed || count < 2 || graph->passes[count - 2].constants.stage != STAGE_FIRST)
        return true;
    memcpy(&row, &graph->passes[count - 2], sizeof row);
    vkb_add_from_image_variant(choice, &row, &row);
    memcpy(&row, columns, sizeof row);
    row.fused = true;
    return graph->pass_count == count || vkb_add_variant_pass(choice, &row);
}

bool vkb_add_ended_lines_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    const struct vkb_graph *graph = choice->graph;
    const struct vkb_filter *filter = pass->filters;
    const struct vkb_adjoint_filter_params *params = &pass->params.adjoint_filter;
    const struct vkb_pass_row *last =
        graph->pass_count >= 2 ? &graph->passes[graph->pass_count - 2] : NULL;
    struct vkb_pass_row row;

    if (choice->failed || !last || last->shader != &vkb_shader_fft_lines_spectra
        || last->constants.stage != STAGE_LAST || last->targets[0] != pass->reads[SLOT_COTANGENTS]
        || last->constants.weighted || last->constants.adds_image || filter->kernels > 1
        || params->gain != 1.0f || pass->constants.masked || !vkb_axis_is_identity(&filter->x)
        || !vkb_axis_is_identity(&filter->y))
        return true;
    memcpy(&row, last, sizeof row);
    row.targets[0] = pass->targets[0];
    row.fused = row.gains_if_finite = true;
    row.constants.adds_image = pass->constants.adds_image;
    row.constants.of_source = pass->constants.of_source;
    row.params.fft.share = params->share;
    row.reads[SLOT_ADDED] = pass->reads[SLOT_ADDED];
    vkb_read_at(&row, SLOT_DIFFERENTIATED, pass->reads[SLOT_DIFFERENTIATED]);
    for (enum vkb_slot slot = SLOT_ADDED; slot <= SLOT_DIFFERENTIATED; ++slot)
        if (row.reads[slot] != VKB_NO_IMAGE
            && graph->images[row.reads[slot]].format != VKB_FORMAT_RGBA32_FLOAT)
            return true;
    return vkb_add_variant_pass(choice, &row);
}

bool vkb_add_transform_lines_variant(struct vkb_variant_choice *choice,
                                     const struct vkb_pass_row *pass)
{
    struct vkb_pass_row row;

    if (!pass->transform.width || !find_lines(choice, pass)->held)
        return false;
    if (pass->block == VKB_BLOCK_fft_kernel) {
        row = make_placing(choice, pass);
        return vkb_add_variant_pass(choice, &row);
    }
    if (pass->block == VKB_BLOCK_products)
        return add_products(choice, pass);
    // The first stage along an axis stands for all.
    if (pass->transform.stages == 0)
        return true;
    if (pass->constants.stage == STAGE_FIRST)
        hold_spectra(choice, pass, pass->targets[0]);
    row = make_row(choice, pass, pass + pass->transform.stages);
    if (pass->constants.stage == STAGE_FIRST)
        read_composite(choice, &row);
    return vkb_add_variant_pass(choice, &row)
        && (!vkb_pass_in_place(&row) || add_from_image(choice, &row));
}

// Half of the frequencies of each channel.
static uint32_t spectra_width(const struct vkb_pass_row *pass)
{
    return 2 * (pass->transform.width / 2 + 1);
}

// The same for all passes of a convolution.
static bool runs_on_host(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    return pass->transform.width && choice->device->linear_texels
        && vkb_image_fits_linear_texels(choice->device, VKB_FORMAT_RGBA32_FLOAT,
                                        spectra_width(pass), pass->transform.height);
}

// A kernel is transformed in place.
static bool transforms_kernel(const struct vkb_pass_row *row)
{
    return row->reads[SLOT_SOURCE] == row->targets[0];
}

// A given kernel as one channel.
static uint32_t add_grey_kernel(struct vkb_variant_choice *choice, uint32_t kernel)
{
    const struct vkb_image_row *given = &choice->graph->images[kernel];
    struct vkb_image_row row = *given;
    uint32_t image = 0;

    snprintf(row.name, sizeof row.name, "grey_%s", given->name + !given->framebuffer);
    row.format = VKB_FORMAT_R32_FLOAT;
    row.channels = 0;
    row.framebuffer = false;
    choice->failed =
        choice->failed || !vkb_graph_add_image(choice->graph, &row, &image, choice->error);
    return image;
}

// Puts the kernel to its places and transforms its rows.
static bool add_host_kernel(struct vkb_variant_choice *choice, struct vkb_pass_row *row)
{
    uint32_t width = spectra_width(row);

    if (row->params.fft_kernel.grey) {
        width = vkb_host_grey_width(row->transform.width / 2 + 1);
        vkb_read_only(row, add_grey_kernel(choice, row->reads[SLOT_SOURCE]));
    }
    choice->graph->images[row->targets[0]].width = width;
    return vkb_add_host_pass(choice, row, vkb_host_kernel_rows);
}

static bool add_host_rows_forth(struct vkb_variant_choice *choice, struct vkb_pass_row *row)
{
    // Transforms of one glow by several weights share its floats.
    if (row->constants.stage == STAGE_FIRST)
        vkb_read_host_floats(choice, row);
    choice->graph->images[row->targets[0]].width = spectra_width(row);
    return vkb_add_host_pass(choice, row, vkb_host_rows_forth);
}

static bool add_host_rows_back(struct vkb_variant_choice *choice, struct vkb_pass_row *row)
{
    row->constants.stage = STAGE_LAST;
    row->params.fft.kept = (int)choice->graph->images[row->targets[0]].width;
    return vkb_add_host_pass(choice, row, vkb_host_rows_back);
}

// Columns forth, also with the product and back, or columns back.
static bool add_host_columns(struct vkb_variant_choice *choice, struct vkb_pass_row *row,
                             const struct vkb_pass_row *end)
{
    struct vkb_image_row *target = &choice->graph->images[row->targets[0]];
    const bool returns =
        copy_product(row, end - row->transform.stages, end) || row->constants.inverse;

    if (!transforms_kernel(row))
        target->width = spectra_width(row);
    target->height = returns ? (uint32_t)end[-1].params.fft.kept : row->transform.height;
    row->params.fft.kept = (int)target->height;
    return vkb_add_host_pass(choice, row, vkb_host_columns);
}

bool vkb_add_host_transform_variant(struct vkb_variant_choice *choice,
                                    const struct vkb_pass_row *pass)
{
    const struct vkb_pass_row *end = pass + pass->transform.stages;
    struct vkb_pass_row row;

    if (!runs_on_host(choice, pass))
        return false;
    memcpy(&row, pass, sizeof row);
    if (pass->block == VKB_BLOCK_fft_kernel)
        return add_host_kernel(choice, &row);
    if (pass->block == VKB_BLOCK_products) {
        choice->graph->images[row.targets[0]].width = spectra_width(pass);
        return vkb_add_host_pass(choice, &row, vkb_host_products);
    }
    // The first stage along an axis stands for all. The rows of a kernel are transformed.
    if (pass->transform.stages == 0
        || (transforms_kernel(pass) && pass->constants.direction == DIRECTION_HORIZONTAL
            && !pass->constants.inverse))
        return true;
    if (row.constants.inverse) {
        row.targets[0] = end[-1].targets[0];
        copy_weighing(&row, end - 1);
    }
    if (row.constants.direction == DIRECTION_VERTICAL)
        return add_host_columns(choice, &row, end);
    return row.constants.inverse ? add_host_rows_back(choice, &row)
                                 : add_host_rows_forth(choice, &row);
}
