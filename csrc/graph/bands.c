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

// How many rows of the images that it reads a pass may need beyond those at its target's place: its
// taps, and what is between them.
static double own_reach(const struct vkb_pass_row *pass)
{
    // Nine taps a pixel of the target apart, whose source may be twice as large.
    if (pass->shader == VKB_SHADER_hdrp_blur_frag || pass->shader == VKB_SHADER_godot_blur_frag)
        return 12.0;
    switch (pass->block) {
    case VKB_BLOCK_blur:
        return 2.0 + pass->constants.radius * fabs(pass->params.blur.step_y);
    case VKB_BLOCK_pyramid:
        return 4.0 + 2.0 * fabs(pass->params.pyramid.step_y);
    case VKB_BLOCK_prefilter:
        return 4.0 + 2.0 * fabs(pass->params.prefilter.step_y);
    case VKB_BLOCK_kawase:
        return 4.0 + fabs(pass->params.kawase.offset);
    default:
        return 4.0;
    }
}

// The same in rows of the source.
static double reach_of(const struct vkb_graph *graph, const struct vkb_pass_row *pass,
                       uint32_t height)
{
    uint32_t least = height;

    for (uint32_t i = 0; i < pass->read_count; ++i)
        if (graph->images[pass->reads[i]].height < least)
            least = graph->images[pass->reads[i]].height;
    return own_reach(pass) * height / least;
}

// The first row of a band must be one of every image, and an even one where shaders take rows in
// pairs.
static bool align(struct vkb_bands *bands, uint32_t image_height, uint32_t height)
{
    const uint32_t own = 2 * (height / common_divisor(height, image_height));
    const uint64_t step = (uint64_t)bands->step / common_divisor(bands->step, own) * own;

    bands->step = (uint32_t)step;
    return step < height;
}

// A pass that runs band by band: its reach, and the sizes of its images.
static bool include(const struct vkb_graph *graph, const struct vkb_pass_row *pass, uint32_t height,
                    double *reach, struct vkb_bands *bands)
{
    bool fits = pass->geometry == VKB_GEOMETRY_FULLSCREEN && pass->depth == VKB_NO_IMAGE
             && !pass->constants.dither && pass->constants.sampling != SAMPLING_FILTER;

    *reach += reach_of(graph, pass, height);
    for (uint32_t i = 0; fits && i < pass->read_count; ++i)
        fits = align(bands, graph->images[pass->reads[i]].height, height);
    return fits && align(bands, graph->images[pass->targets[0]].height, height);
}

// Stages of glare read far from a target's place, and levels of their own beside the bloom's.
static bool has_glare(const struct vkb_graph *graph)
{
    for (uint32_t i = 0; i < graph->pass_count; ++i)
        if (graph->passes[i].block == VKB_BLOCK_streaks)
            return true;
    return false;
}

bool vkb_graph_bands(const struct vkb_graph *graph, uint32_t output, uint32_t height,
                     struct vkb_bands *bands)
{
    double before = 0.0, after = 0.0;

    *bands = (struct vkb_bands){.head = VKB_NO_IMAGE, .step = 1};
    if (has_glare(graph))
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
        if (!include(graph, pass, height, writes_tall ? &after : &before, bands))
            return false;
        for (uint32_t read = 0; writes_tall && read < pass->read_count; ++read) {
            const uint32_t image = pass->reads[read];
            if (is_tall(graph, image, height) || is_among(image, bands->levels, bands->level_count))
                continue;
            // An image that is read back and given again must be one that the host can give.
            if (bands->level_count == GATHERED_LEVELS || bands->head == VKB_NO_IMAGE)
                return false;
            bands->levels[bands->level_count++] = image;
        }
    }
    // What is tall may be in either part.
    bands->reach = (uint32_t)ceil(before + after);
    for (uint32_t i = 0; i < bands->level_count; ++i)
        if (graph->images[bands->levels[i]].format == VKB_FORMAT_RG11B10_UFLOAT)
            return false;
    return is_tall(graph, output, height)
        && (bands->head == VKB_NO_IMAGE
            || (bands->level_count > 0
                && graph->images[bands->head].format != VKB_FORMAT_RG11B10_UFLOAT));
}

static bool find_image(const struct vkb_graph *graph, const char *name, uint32_t *image,
                       struct vkb_error *error)
{
    for (*image = 0; *image < graph->image_count; ++*image)
        if (strcmp(graph->images[*image].name, name) == 0)
            return true;
    return vkb_fail(error, VKB_ERROR_VALUE, "part: there is no image %s", name);
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
        // Under a name that no pass writes: the image is cached by it.
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

static bool shorten(struct vkb_graph *graph, const struct vkb_part *part, struct vkb_error *error)
{
    for (uint32_t i = 0; i < graph->image_count; ++i) {
        struct vkb_image_row *row = &graph->images[i];
        const uint64_t rows = (uint64_t)row->height * part->rows;
        if (part->rows == 0 && row->input != VKB_INPUT_NONE && row->input < VKB_INPUT_LEVEL)
            return vkb_fail(error, VKB_ERROR_VALUE, "part: it needs the %s", row->name);
        if (part->rows > 0 && rows % part->height != 0)
            return vkb_fail(error, VKB_ERROR_VALUE, "part: %s has no such rows", row->name);
        if (part->rows > 0)
            row->height = (uint32_t)(rows / part->height);
    }
    for (uint32_t i = 0; part->rows > 0 && i < graph->pass_count; ++i) {
        struct vkb_pass_row *pass = &graph->passes[i];
        vkb_params_set_height(pass->block, (int)graph->images[pass->targets[0]].height,
                              &pass->params);
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
    return found && shorten(graph, part, error);
}
