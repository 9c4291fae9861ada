#include "passes/fft.h"

#include <stdio.h>
#include <string.h>

static bool is_length(uint32_t number)
{
    static const uint32_t odd[] = {1, 3, 5, 9, 15, 25, 45, 75, 225};

    while (number % 2 == 0)
        number /= 2;
    for (size_t i = 0; i < sizeof odd / sizeof odd[0]; ++i)
        if (number == odd[i])
            return true;
    return false;
}

struct vkb_fft_axis vkb_fft_axis(uint32_t least)
{
    struct vkb_fft_axis axis = {.padded = least, .parts = 1};

    while (!is_length(axis.padded))
        ++axis.padded;
    // Two passes with lines of about the same length.
    if (axis.padded > FFT_ELEMENTS) {
        while ((axis.parts + 1) * (axis.parts + 1) <= axis.padded)
            ++axis.parts;
        while (axis.padded % axis.parts != 0)
            --axis.parts;
    }
    axis.length = axis.padded / axis.parts;
    return axis;
}

// The radices of a line's stages as hexadecimal digits, the first one in the lowest; one stage at
// least.
static void set_stages(uint32_t length, struct vkb_fft_params *params)
{
    static const uint32_t radices[] = {4, 2, 3, 5};

    params->radices = length == 1;
    params->stages = length == 1;
    for (size_t i = 0; i < sizeof radices / sizeof radices[0]; ++i)
        for (; length % radices[i] == 0; length /= radices[i])
            params->radices |= (int)(radices[i] << 4 * params->stages++);
}

// As many lines as fit the shared memory, at most `count`; a divisor of it where they are parts of
// one line.
static uint32_t lines_of(uint32_t length, uint32_t count, bool parts)
{
    uint32_t lines = FFT_ELEMENTS / length;

    lines = lines < count ? lines : count;
    // More lines than these in a workgroup leave too few workgroups.
    lines = lines < FFT_MOST_LINES ? lines : FFT_MOST_LINES;
    while (parts && count % lines != 0)
        --lines;
    return lines;
}

// One pass: lines of `length` elements, of which there are `parts` along the axis.
struct pass {
    uint32_t length, parts;
    bool strided;  // the elements of a line are `parts` apart, else they follow each other
    bool first, last, rotate;
};

static struct vkb_pass_row make_row(const struct vkb_graph *graph, const struct vkb_fft *fft,
                                    const struct pass *pass, uint32_t from, uint32_t target)
{
    const struct vkb_image_row *image = &graph->images[target];
    const bool horizontal = fft->direction == DIRECTION_HORIZONTAL;
    const bool along = horizontal && pass->parts > 1;
    const uint32_t across = horizontal ? image->height : image->width;
    const uint32_t lines = lines_of(pass->length, along ? pass->parts : across, along);
    const uint32_t groups_along = along ? pass->parts / lines : pass->parts;
    const uint32_t groups_across = along ? across : (across + lines - 1) / lines;
    struct vkb_pass_row row = vkb_fullscreen_row(fft->pass, VKB_SHADER_fft_comp, target);

    row.vertex = (enum vkb_shader)0;
    row.geometry = VKB_GEOMETRY_DISPATCH;
    row.variant = "transform";
    row.block_width = row.block_height = 1;
    row.groups_width = horizontal ? groups_along : groups_across;
    row.groups_height = horizontal ? groups_across : groups_along;
    row.reads[0] = from;
    // Every binding of the shader must be filled, also one that this pass does not read.
    row.reads[1] = pass->first && fft->input.load == FFT_LOAD_PRODUCT ? fft->factor : from;
    row.read_count = 2;
    row.block = VKB_BLOCK_fft;
    if (pass->first)
        row.params.fft = fft->input.params;
    row.params.fft.horizontal = horizontal;
    row.params.fft.inverse = fft->inverse;
    row.params.fft.reads = pass->first ? (int)fft->input.load : FFT_LOAD_PART;
    row.params.fft.boundary = pass->first ? (int)fft->input.boundary : BOUNDARY_ZERO;
    row.params.fft.grey = pass->first && fft->input.grey;
    row.params.fft.rotates = pass->rotate;
    row.params.fft.stores = pass->last && fft->target != VKB_NO_IMAGE;
    row.params.fft.parts_together = along;
    row.params.fft.elements = (int)pass->length;
    row.params.fft.lines = (int)lines;
    set_stages(pass->length, &row.params.fft);
    row.params.fft.padded = (int)fft->axis.padded;
    row.params.fft.across = (int)across;
    row.params.fft.part_step = pass->strided ? 1 : (int)pass->length;
    row.params.fft.element_step = pass->strided ? (int)pass->parts : 1;
    row.params.fft.limit = vkb_formats[image->format].limit;
    return row;
}

static bool add_pass(struct vkb_graph *graph, const struct vkb_fft *fft, const struct pass *pass,
                     uint32_t from, uint32_t target, struct vkb_error *error)
{
    const struct vkb_pass_row row = make_row(graph, fft, pass, from, target);

    return vkb_graph_add_pass(graph, &row, error);
}

bool vkb_add_fft(struct vkb_graph *graph, const struct vkb_fft *fft, uint32_t *result,
                 struct vkb_error *error)
{
    const struct vkb_fft_axis *axis = &fft->axis;
    const bool horizontal = fft->direction == DIRECTION_HORIZONTAL;
    // Long lines of elements that lie apart, then, on the way back first, those that follow.
    const struct pass apart = {axis->length,  axis->parts,  true,
                               !fft->inverse, fft->inverse, !fft->inverse};
    const struct pass follow = {axis->parts,  axis->length,  false,
                                fft->inverse, !fft->inverse, fft->inverse};
    const struct pass whole = {axis->length, 1, true, true, true, false};
    const struct vkb_size padded = {
        .width = horizontal ? axis->padded : fft->size.width,
        .height = horizontal ? fft->size.height : axis->padded,
    };
    char name[VKB_NAME_SIZE];
    uint32_t part;

    *result = fft->target;
    if (axis->parts > 1) {
        snprintf(name, sizeof name, "%.24s_part", fft->image);
        if (!vkb_add_target(graph, name, VKB_FORMAT_RGBA32_FLOAT, padded, false, &part, error)
            || !add_pass(graph, fft, fft->inverse ? &follow : &apart, fft->from, part, error))
            return false;
    }
    if (*result == VKB_NO_IMAGE
        && !vkb_add_target(graph, fft->image, VKB_FORMAT_RGBA32_FLOAT, fft->size, false, result,
                           error))
        return false;
    return axis->parts > 1
             ? add_pass(graph, fft, fft->inverse ? &apart : &follow, part, *result, error)
             : add_pass(graph, fft, &whole, fft->from, *result, error);
}
