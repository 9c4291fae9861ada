#include "graph/bands.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static bool is_tall(const struct vkb_graph *graph, uint32_t image, uint32_t height)
{
    return graph->images[image].height == height;
}

static bool reads_tall(const struct vkb_graph *graph, const struct vkb_pass_row *pass,
                       uint32_t height)
{
    for (uint32_t i = 0; i < pass->read_count; ++i)
        if (is_tall(graph, pass->reads[i], height))
            return true;
    return false;
}

static bool is_among(uint32_t image, const uint32_t *images, uint32_t count)
{
    for (uint32_t i = 0; i < count; ++i)
        if (images[i] == image)
            return true;
    return false;
}

static uint32_t common_divisor(uint32_t a, uint32_t b)
{
    while (b > 0) {
        const uint32_t rest = a % b;
        a = b;
        b = rest;
    }
    return a;
}

// The reach of a pass in rows of the source.
static double reach_of(const struct vkb_graph *graph, const struct vkb_pass_row *pass,
                       uint32_t height)
{
    uint32_t least = height;

    for (uint32_t i = 0; i < pass->read_count; ++i)
        if (graph->images[pass->reads[i]].height < least)
            least = graph->images[pass->reads[i]].height;
    return (double)pass->reach * height / least;
}

// Whether bands of the pass may start at any row. Its shader then computes positions from the
// complete heights.
static bool starts_anywhere(const struct vkb_graph *graph, const struct vkb_pass_row *pass)
{
    const uint32_t height = graph->images[pass->targets[0]].height;
    bool same = true;

    for (uint32_t i = 0; i < pass->read_count; ++i)
        same = same && graph->images[pass->reads[i]].height == height;
    return (same && pass->band_rows != VKB_BAND_EVEN_ROW)
        || (pass->band_rows == VKB_BAND_ANY_ROW && pass->constants.sampling == SAMPLING_FETCH);
}

// Halving and doubling pair rows, so that bands must start at an even row of the image. False if
// only the first band does.
static bool align(struct vkb_bands *bands, uint32_t image_height, uint32_t height)
{
    const uint32_t own = 2 * (height / common_divisor(height, image_height));
    const uint64_t step = (uint64_t)bands->step / common_divisor(bands->step, own) * own;

    bands->step = (uint32_t)step;
    return step < height;
}

// Adds the reach of a pass, and aligns the bands to its images. False if it cannot run by bands.
static bool add_pass(const struct vkb_graph *graph, const struct vkb_pass_row *pass,
                     uint32_t height, double *reach, struct vkb_bands *bands)
{
    bool fits = pass->geometry == VKB_GEOMETRY_FULLSCREEN && pass->depth == VKB_NO_IMAGE
             && !pass->constants.dither && pass->constants.sampling != SAMPLING_FILTER;

    *reach += reach_of(graph, pass, height);
    if (starts_anywhere(graph, pass))
        return fits;
    for (uint32_t i = 0; fits && i < pass->read_count; ++i)
        fits = align(bands, graph->images[pass->reads[i]].height, height);
    return fits && align(bands, graph->images[pass->targets[0]].height, height);
}

static bool reaches_everywhere(const struct vkb_graph *graph)
{
    for (uint32_t i = 0; i < graph->pass_count; ++i)
        if (isinf(graph->passes[i].reach))
            return true;
    return false;
}

bool vkb_graph_bands(const struct vkb_graph *graph, uint32_t output, uint32_t height,
                     struct vkb_bands *bands)
{
    double before = 0.0, after = 0.0;

    *bands = (struct vkb_bands){.head = VKB_NO_IMAGE, .step = 1};
    if (reaches_everywhere(graph))
        return false;
    for (uint32_t i = 0; i < graph->pass_count; ++i)
        if (!is_tall(graph, graph->passes[i].targets[0], height)
            && reads_tall(graph, &graph->passes[i], height))
            bands->head = graph->passes[i].targets[0];
    for (uint32_t i = 0; i < graph->pass_count; ++i) {
        const struct vkb_pass_row *pass = &graph->passes[i];
        const bool writes_tall = is_tall(graph, pass->targets[0], height);
        if (!writes_tall && !reads_tall(graph, pass, height))
            continue;
        if (!add_pass(graph, pass, height, writes_tall ? &after : &before, bands))
            return false;
        for (uint32_t read = 0; writes_tall && read < pass->read_count; ++read) {
            const uint32_t image = pass->reads[read];
            if (is_tall(graph, image, height) || is_among(image, bands->levels, bands->level_count))
                continue;
            // The image is read back and given again, and there is a limit of such inputs.
            if (bands->level_count == GATHERED_LEVELS || bands->head == VKB_NO_IMAGE)
                return false;
            bands->levels[bands->level_count++] = image;
        }
    }
    // A pass that reads and writes images of full height may run before or after the smaller
    // images.
    bands->reach = (uint32_t)ceil(before + after);
    for (uint32_t i = 0; i < bands->level_count; ++i)
        if (vkb_is_rounded(graph->images[bands->levels[i]].format))
            return false;
    return is_tall(graph, output, height)
        && (bands->head == VKB_NO_IMAGE
            || (bands->level_count > 0 && !vkb_is_rounded(graph->images[bands->head].format)));
}

static bool find_image(const struct vkb_graph *graph, const char *name, uint32_t *image,
                       struct vkb_error *error)
{
    *image = vkb_graph_find(graph, name);
    return *image != VKB_NO_IMAGE
        || vkb_fail(error, VKB_ERROR_VALUE, "part: there is no image %s", name);
}

static bool mark_images(struct vkb_graph *graph, const struct vkb_part *part, bool *wanted,
                        struct vkb_error *error)
{
    uint32_t image;

    for (uint32_t i = 0; i < graph->image_count; ++i)
        graph->images[i].framebuffer = false;
    for (uint32_t i = 0; i < part->output_count; ++i) {
        if (!find_image(graph, part->outputs[i], &image, error))
            return false;
        graph->images[image].framebuffer = wanted[image] = true;
    }
    for (uint32_t i = 0; i < part->level_count; ++i) {
        if (!find_image(graph, part->levels[i], &image, error))
            return false;
        graph->images[image].input = (enum vkb_input_kind)(VKB_INPUT_LEVEL + (int)i);
    }
    return true;
}

// Keeps the passes that the wanted images need, from the last to the first.
static void keep_passes(struct vkb_graph *graph, bool *wanted)
{
    uint32_t kept = graph->pass_count;

    for (uint32_t i = graph->pass_count; i-- > 0;) {
        const struct vkb_pass_row *pass = &graph->passes[i];
        const uint32_t target = pass->targets[0];
        if (!wanted[target] || graph->images[target].input != VKB_INPUT_NONE)
            continue;
        for (uint32_t read = 0; read < pass->read_count; ++read)
            wanted[pass->reads[read]] = true;
        --kept;
        if (kept != i)
            graph->passes[kept] = *pass;
    }
    graph->pass_count -= kept;
    memmove(graph->passes, graph->passes + kept, graph->pass_count * sizeof *graph->passes);
}

static void keep_images(struct vkb_graph *graph, const bool *wanted, uint32_t *places)
{
    uint32_t kept = 0;

    for (uint32_t i = 0; i < graph->image_count; ++i) {
        struct vkb_image_row *row = &graph->images[i];
        if (!wanted[i])
            continue;
        // Images are cached by name. The names of images that passes write are taken.
        if (row->input >= VKB_INPUT_LEVEL)
            snprintf(row->name, sizeof row->name, "level_%d", row->input - VKB_INPUT_LEVEL);
        graph->images[kept] = *row;
        places[i] = kept++;
    }
    graph->image_count = kept;
    for (uint32_t i = 0; i < graph->pass_count; ++i) {
        struct vkb_pass_row *pass = &graph->passes[i];
        for (uint32_t read = 0; read < pass->read_count; ++read)
            pass->reads[read] = places[pass->reads[read]];
        pass->targets[0] = places[pass->targets[0]];
    }
}

struct rows {
    uint32_t first, end;
};

// The rows of an image for a band of the source. An image that is given contains all rows that the
// band may read. An image that is rendered contains only the rows that depend on no other band.
static struct rows rows_of(const struct vkb_image_row *image, const struct vkb_part *part)
{
    const uint64_t first = (uint64_t)part->first * image->height,
                   end = first + (uint64_t)part->rows * image->height;
    const uint32_t before = image->input >= VKB_INPUT_LEVEL ? 0 : part->height - 1;
    const uint32_t after = part->height - 1 - before;

    return (struct rows){(uint32_t)((first + before) / part->height),
                         (uint32_t)((end + after) / part->height)};
}

static bool is_split(const struct vkb_image_row *image, const struct vkb_part *part)
{
    const uint64_t end = (uint64_t)part->first + part->rows;

    return part->first * (uint64_t)image->height % part->height != 0
        || end * image->height % part->height != 0;
}

static void set_rows(const struct vkb_graph *graph, const struct vkb_part *part,
                     struct vkb_pass_row *pass)
{
    const struct vkb_image_row *target = &graph->images[pass->targets[0]];
    const struct vkb_image_row *source = &graph->images[pass->reads[0]];
    const struct rows to = rows_of(target, part), from = rows_of(source, part);
    struct vkb_params_rows rows = {.target_height = (int)(to.end - to.first)};

    if (starts_anywhere(graph, pass))
        rows = (struct vkb_params_rows){
            .target_height = (int)target->height,
            .source_height = (int)source->height,
            .row_offset = (int)(2
                                * ((int64_t)to.first * source->height
                                   - (int64_t)from.first * target->height)),
        };
    vkb_params_set_rows(pass->block, &rows, &pass->params);
}

static bool set_band(struct vkb_graph *graph, const struct vkb_part *part, struct vkb_error *error)
{
    for (uint32_t i = 0; i < graph->pass_count; ++i) {
        struct vkb_pass_row *pass = &graph->passes[i];
        bool split = is_split(&graph->images[pass->targets[0]], part);
        for (uint32_t read = 0; read < pass->read_count; ++read)
            split = split || is_split(&graph->images[pass->reads[read]], part);
        if (split && !starts_anywhere(graph, pass))
            return vkb_fail(error, VKB_ERROR_VALUE, "part: %s has no such rows", pass->name);
        set_rows(graph, part, pass);
    }
    for (uint32_t i = 0; i < graph->image_count; ++i) {
        const struct rows rows = rows_of(&graph->images[i], part);
        if (rows.end <= rows.first)
            return vkb_fail(error, VKB_ERROR_VALUE, "part: %s has no such rows",
                            graph->images[i].name);
        graph->images[i].height = rows.end - rows.first;
    }
    return true;
}

// Without a band the part reads no row of the source.
static bool check_inputs(const struct vkb_graph *graph, struct vkb_error *error)
{
    for (uint32_t i = 0; i < graph->image_count; ++i) {
        const struct vkb_image_row *row = &graph->images[i];
        if (row->input != VKB_INPUT_NONE && row->input < VKB_INPUT_LEVEL)
            return vkb_fail(error, VKB_ERROR_VALUE, "part: it needs the %s", row->name);
    }
    return true;
}

bool vkb_graph_take(struct vkb_graph *graph, const struct vkb_part *part, struct vkb_error *error)
{
    const uint32_t count = graph->image_count;
    bool *wanted = vkb_alloc(error, count, sizeof *wanted);
    uint32_t *places = vkb_alloc(error, count, sizeof *places);
    const bool found = wanted && places && mark_images(graph, part, wanted, error);

    if (found) {
        keep_passes(graph, wanted);
        keep_images(graph, wanted, places);
    }
    vkb_free(wanted);
    vkb_free(places);
    return found && (part->rows > 0 ? set_band(graph, part, error) : check_inputs(graph, error));
}
