// Variants of adjoint passes: transposed filters in blocks of texels and in tiles.
#include "variants/variant.h"

#include "passes/taps.h"

#include <math.h>
#include <string.h>

// The entries of an axis in the table of weights (passes/taps.h) begin at `start`; below 0: the
// pass keeps the axis.
struct axis {
    const float (*texels)[4];
    int32_t start;
    uint32_t size;
};

static struct axis axis_of(const struct vkb_graph *graph, const struct vkb_pass_row *pass,
                           bool vertical)
{
    const struct vkb_adjoint_filter_params *params = &pass->params.adjoint_filter;
    const struct vkb_image_row *target = &graph->images[pass->targets[0]];
    const int32_t kept = vertical ? DIRECTION_HORIZONTAL : DIRECTION_VERTICAL;

    return (struct axis){
        .texels = graph->images[pass->reads[SLOT_WEIGHTS]].pixels,
        .start = pass->constants.direction == kept ? -1
               : vertical                          ? params->start_y
                                                   : params->start_x,
        .size = vertical ? target->height : target->width,
    };
}

static const float *entry_of(const struct axis *axis, uint32_t texel)
{
    const uint32_t last = axis->size - 1;

    return axis->texels[(uint32_t)axis->start + (texel < last ? texel : last)];
}

// The most weights of columns that an invocation keeps: the driver compiles a load of each.
enum { MAX_LINEAR = 128 };

bool vkb_are_floats(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    bool fits = vkb_fits_linear(choice, pass);

    for (uint32_t i = 0; i < pass->read_count; ++i)
        fits = fits
            && (pass->reads[i] == VKB_NO_IMAGE
                || choice->graph->images[pass->reads[i]].format == VKB_FORMAT_RGBA32_FLOAT);
    return fits;
}

bool vkb_is_factor(const struct vkb_pass_row *pass)
{
    return vkb_transposes(pass, VKB_BLOCK_composite) && !pass->constants.masked
        && pass->constants.by == BY_BLOOM && !pass->constants.add_own && !pass->constants.of_source
        && pass->reads[SLOT_BLOOM] == VKB_NO_IMAGE
        && (pass->constants.composite == COMPOSITE_ADD
            || pass->constants.composite == COMPOSITE_MIX);
}

// Reads the cotangents of a composite without a curve in place of those of its bloom.
static void read_composite(const struct vkb_graph *graph, struct vkb_pass_row *row)
{
    const struct vkb_pass_row *pass = vkb_writer_of(graph, row->reads[SLOT_COTANGENTS]);

    if (!pass || !vkb_is_factor(pass))
        return;
    const struct vkb_composite_params *params = &pass->params.composite;
    const float intensity = pass->constants.lit ? 1.0f : params->intensity;
    // Godot's exposure is of the scene alone.
    const float exposure = pass->constants.exposed_scene ? 0.0f : params->exposure;
    row->params.adjoint_filter.gain *= intensity * exp2f(exposure);
    row->constants.through_composite = true;
    row->reads[SLOT_COTANGENTS] = pass->reads[SLOT_COTANGENTS];
    row->reads[SLOT_SCENE] = pass->reads[SLOT_SCENE];
}

// The same, if its images have linear texels, too.
static void read_linear_of_composite(const struct vkb_variant_choice *choice,
                                     struct vkb_pass_row *row)
{
    struct vkb_pass_row fused;

    memcpy(&fused, row, sizeof fused);
    read_composite(&choice->plain, &fused);
    if (vkb_are_floats(choice, &fused))
        memcpy(row, &fused, sizeof fused);
}

bool vkb_add_adjoint_linear(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    const struct vkb_adjoint_filter_params *params = &pass->params.adjoint_filter;
    struct vkb_pass_row row;

    if (!(pass->block == VKB_BLOCK_adjoint_filter
          && pass->constants.kernels * params->span_x <= MAX_LINEAR
          && vkb_are_floats(choice, pass)))
        return false;
    memcpy(&row, pass, sizeof row);
    row.constants.span_width = params->span_x;
    row.constants.span_height = params->span_y;
    row.gains_if_finite = true;
    read_linear_of_composite(choice, &row);
    vkb_make_linear(&row, &vkb_shader_adjoint_taps_linear_rgba32float, ADJOINT_SIDE, ADJOINT_ROWS);
    return vkb_add_variant(choice, &row);
}

// An invocation for all kernels of a pixel, which fragments would compute anew for each.
bool vkb_add_adjoint_kernels(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    struct vkb_pass_row row;

    if (!(vkb_transposes(pass, VKB_BLOCK_prefilter) && pass->constants.stacked_samples > 1))
        return false;
    memcpy(&row, pass, sizeof row);
    vkb_make_dispatch(&row, pass->shader->dispatch, PIXEL_INVOCATIONS, PIXEL_INVOCATIONS);
    // Those of one picture, since llvmpipe also runs what an early end leaves out.
    const struct vkb_image_row *target = &choice->graph->images[row.targets[0]];
    const uint32_t height = target->height / (uint32_t)row.constants.stacked_samples;
    row.groups_width = (target->width + PIXEL_INVOCATIONS - 1) / PIXEL_INVOCATIONS;
    row.groups_height = (height + PIXEL_INVOCATIONS - 1) / PIXEL_INVOCATIONS;
    return vkb_add_variant(choice, &row);
}

// The most readers of a texel; too many for tiles where those of the next one begin before.
static int32_t most_readers(const struct axis *axis)
{
    int32_t most = 1;

    for (uint32_t texel = 0; axis->start >= 0 && texel < axis->size; ++texel) {
        const float *entry = entry_of(axis, texel);
        if (entry_of(axis, texel + 1)[0] < entry[0])
            return MAX_READERS + 1;
        most = (int32_t)fmaxf((float)most, entry[1]);
    }
    return most;
}

static uint32_t readers_of_image(const struct vkb_graph *graph, uint32_t image)
{
    uint32_t readers = 0;

    for (uint32_t i = 0; i < graph->pass_count; ++i)
        readers += graph->passes[i].block == VKB_BLOCK_adjoint_filter
                && graph->passes[i].reads[SLOT_COTANGENTS] == image;
    return readers;
}

// The pass along the other axis that only this one reads, with few readers; NULL: there is none.
static const struct vkb_pass_row *other_axis(const struct vkb_variant_choice *choice,
                                             const struct vkb_pass_row *pass)
{
    const struct vkb_graph *graph = &choice->plain;
    const struct vkb_pass_row *first = vkb_writer_of(graph, pass->reads[SLOT_COTANGENTS]);

    if (!(pass->constants.direction != DIRECTION_BOTH && first
          && first->block == VKB_BLOCK_adjoint_filter && !first->constants.add_own
          && !first->constants.of_source && first->constants.direction != DIRECTION_BOTH
          && first->constants.direction != pass->constants.direction
          && readers_of_image(graph, pass->reads[SLOT_COTANGENTS]) == 1))
        return NULL;
    const bool vertical = pass->constants.direction == DIRECTION_VERTICAL;
    const struct axis along = axis_of(choice->graph, pass, vertical);
    const struct axis across = axis_of(choice->graph, first, !vertical);
    return most_readers(&along) <= MAX_WINDOW && most_readers(&across) <= MAX_WINDOW ? first : NULL;
}

// Whether the readers of all texels are in the windows that the ratio of sides gives, and the size
// of these.
static bool has_exact_windows(const struct axis *axis, int32_t exact, int32_t *window)
{
    const int32_t size = exact == EXACT_SAME ? *window : *window + *window % 2;
    bool fits = exact != 0;

    for (uint32_t texel = 0; fits && axis->start >= 0 && texel < axis->size; ++texel) {
        const float *entry = entry_of(axis, texel);
        const int32_t first = WINDOW_FIRST(exact, (int32_t)texel, size), reader = (int32_t)entry[0];
        fits = reader >= first && reader + (int32_t)entry[1] <= first + size;
    }
    *window = fits ? size : *window;
    return fits;
}

// The weight of one kernel that a texel has in a pixel of its window.
static float weight_in(const struct axis *axis, uint32_t texel, int32_t pixel)
{
    const float *entry = entry_of(axis, texel);
    const float (*list)[4] = axis->texels + (uint32_t)entry[2];
    const int32_t first = (int32_t)entry[0];
    const bool reads = pixel >= first && pixel < first + (int32_t)entry[1];

    return reads ? list[pixel - (int32_t)entry[3]][texel % ADJOINT_SIDE] : 0.0f;
}

// The weights in the middle of the axis: of an even texel, then of an odd one.
static void take_inner(const struct axis *axis, int32_t exact, int32_t window, float (*inner)[4])
{
    const uint32_t middle = axis->size / 2 & ~1u;

    for (uint32_t texel = middle; texel < middle + 2 && texel < axis->size; ++texel)
        for (int32_t i = 0; i < window; ++i)
            inner[(texel & 1) * 2 + i / 4][i % 4] =
                weight_in(axis, texel, WINDOW_FIRST(exact, (int32_t)texel, window) + i);
}

// Whether all texels that are not near an edge have the weights of those in the middle, but for
// rounding. Those of ghosts differ. (Where tiles take the weights of the middle is told in
// adjoint_filter_tile.comp.)
static bool has_inner(const struct axis *axis, int32_t exact, int32_t window, uint32_t pixels,
                      const float (*inner)[4])
{
    bool same = true;

    for (uint32_t texel = 0; same && texel < axis->size; ++texel) {
        const int32_t first = WINDOW_FIRST(exact, (int32_t)texel, window);
        if (first < window || first + 2 * window > (int32_t)pixels)
            continue;
        for (int32_t i = 0; i < window; ++i)
            same = same
                && fabsf(inner[(texel & 1) * 2 + i / 4][i % 4] - weight_in(axis, texel, first + i))
                       <= 1e-6f;
    }
    return same;
}

// Makes `row` tiles, along both axes at once also where the plain passes are one for each axis, of
// which `pass` is the last one. False: few readers at positions that differ from row to row, most
// of which are in a cache, or windows that are too large.
static bool make_tiles(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                       struct vkb_pass_row *row)
{
    const struct vkb_graph *graph = choice->graph;
    const struct vkb_pass_row *other = other_axis(choice, pass);
    const bool vertical = pass->constants.direction == DIRECTION_VERTICAL;
    const struct axis x = axis_of(graph, other && vertical ? other : pass, false);
    const struct axis y = axis_of(graph, other && !vertical ? other : pass, true);
    struct vkb_adjoint_filter_params *params = &row->params.adjoint_filter;
    struct vkb_constants *constants = &row->constants;
    int32_t width = most_readers(&x), height = most_readers(&y);

    const struct vkb_image_row *source =
        &graph->images[(other ? other : pass)->reads[SLOT_COTANGENTS]];
    int32_t exact_x = vkb_ratio_of(source->width, x.size);
    int32_t exact_y = vkb_ratio_of(source->height, y.size);
    if (width > MAX_READERS || height > MAX_READERS
        || (pass->constants.kernels == 1 && !exact_y && x.start >= 0 && y.start >= 0))
        return false;
    if (other) {
        row->reads[SLOT_COTANGENTS] = other->reads[SLOT_COTANGENTS];
        params->gain *= other->params.adjoint_filter.gain;
    }
    params->pictures[0][0] = (float)x.start;
    params->pictures[0][1] = (float)y.start;
    if (constants->kernels > 1
        || choice->device->limits.maxComputeSharedMemorySize < FILTER_TILE_SHARED
        || !has_exact_windows(&x, exact_x, &width) || !has_exact_windows(&y, exact_y, &height))
        exact_x = exact_y = 0;
    // Such tiles are turned: they load columns, and x and y change places.
    bool keeps = FILTER_TILE_KEEPS(exact_x, constants->kernels, width, height);
    if (keeps) {
        take_inner(&x, exact_x, width, params->inner_x);
        take_inner(&y, exact_y, height, params->inner_y);
        keeps = has_inner(&x, exact_x, width, source->width, params->inner_x)
             && has_inner(&y, exact_y, height, source->height, params->inner_y);
    }
    // Loops of constant length are slower where they are long: 960 x 540 pixels that 20 x 2 ones
    // read 0.123 ms, 0.094 otherwise (H100, 2026-11-27).
    if (!keeps && width > 1 && height > 1)
        exact_x = exact_y = 0;
    constants->exact = keeps ? exact_y : exact_x;
    constants->exact_rows = keeps ? exact_x : exact_y;
    vkb_make_tiles(choice, row, &vkb_shader_adjoint_filter_tile_comp, keeps ? height : width,
                   keeps ? width : height);
    if (!keeps)
        return true;
    row->block_width = row->block_height;
    row->block_height = FILTER_TILE_COLUMNS;
    return true;
}

// Whether `next` adds the filter of another picture of the same image.
static bool continues(const struct vkb_pass_row *pass, const struct vkb_pass_row *next)
{
    return pass->block == VKB_BLOCK_adjoint_filter && next->block == pass->block
        && pass->constants.kernels == 1 && next->constants.kernels == 1
        && next->reads[SLOT_COTANGENTS] == pass->reads[SLOT_COTANGENTS] && next->constants.add_own
        && next->reads[SLOT_ADDED] == pass->targets[0]
        && next->params.adjoint_filter.gain == pass->params.adjoint_filter.gain;
}

// After the last one of several passes that add up the pictures of one image, adds a fused pass.
static bool add_pictures(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    const struct vkb_graph *plain = &choice->plain;
    const struct vkb_pass_row *first = pass, *end = plain->passes + plain->pass_count;
    struct vkb_pass_row row;
    int32_t width = 1, height = 1;

    while (first > plain->passes && pass - first < MAX_PICTURES - 1 && continues(first - 1, first))
        --first;
    if (first == pass || (pass + 1 < end && continues(pass, pass + 1)))
        return true;
    memcpy(&row, pass, sizeof row);
    row.fused = row.gains_if_finite = true;
    row.reads[SLOT_ADDED] = first->reads[SLOT_ADDED];
    row.constants.add_own = first->constants.add_own;
    row.params.adjoint_filter.share = first->params.adjoint_filter.share;
    for (const struct vkb_pass_row *each = first; each <= pass; ++each) {
        const struct axis x = axis_of(choice->graph, each, false);
        const struct axis y = axis_of(choice->graph, each, true);
        float *picture = row.params.adjoint_filter.pictures[each - first];
        width = (int32_t)fmaxf((float)width, (float)most_readers(&x));
        height = (int32_t)fmaxf((float)height, (float)most_readers(&y));
        picture[0] = (float)x.start;
        picture[1] = (float)y.start;
    }
    vkb_make_tiles(choice, &row, &vkb_shader_adjoint_filter_tile_comp, width, height);
    row.constants.pictures = (int32_t)(pass - first) + 1;
    return width > MAX_WINDOW || height > MAX_WINDOW || vkb_add_variant(choice, &row);
}

bool vkb_add_adjoint_filter(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    struct vkb_pass_row row;

    if (pass->block != VKB_BLOCK_adjoint_filter)
        return false;
    memcpy(&row, pass, sizeof row);
    row.gains_if_finite = true;
    const bool fits_tiles = make_tiles(choice, pass, &row);
    read_composite(&choice->plain, &row);
    return (fits_tiles ? vkb_add_variant(choice, &row) : vkb_add_fullscreen(choice, &row))
        && add_pictures(choice, pass);
}
