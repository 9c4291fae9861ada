#include "methods/adjoint.h"

#include "passes/adjoint.h"
#include "passes/threshold.h"

#include <stdio.h>
#include <string.h>

// The transpose of a pass by its block. Only passes that were given at run time have none.
static vkb_transpose *const transposes[VKB_BLOCK_COUNT] = {
    [VKB_BLOCK_composite] = vkb_transpose_composite,
    [VKB_BLOCK_threshold] = vkb_transpose_threshold,
    [VKB_BLOCK_filter] = vkb_transpose_filters,
    [VKB_BLOCK_prefilter] = vkb_transpose_prefilter,
    [VKB_BLOCK_streaks] = vkb_transpose_streaks,
    [VKB_BLOCK_flare] = vkb_transpose_flare,
    [VKB_BLOCK_dirt] = vkb_transpose_dirt,
    [VKB_BLOCK_blender_end] = vkb_transpose_blender_end,
    [VKB_BLOCK_star] = vkb_transpose_star,
    [VKB_BLOCK_sun_beams] = vkb_transpose_sun_beams,
    [VKB_BLOCK_box] = vkb_transpose_box,
};

// The image of a framebuffer's cotangents, a level of the source.
static bool add_cotangents(struct vkb_adjoint *adjoint, const struct vkb_source *source,
                           const struct vkb_cotangents *cotangents, uint32_t number,
                           struct vkb_error *error)
{
    const char *name = cotangents->names[number];
    const uint32_t image = vkb_graph_find(adjoint->graph, name);
    const struct vkb_level *level = &source->image.levels[number];

    if (image == VKB_NO_IMAGE || number >= source->image.level_count
        || adjoint->cotangents[image] != VKB_NO_IMAGE)
        return vkb_fail(error, VKB_ERROR_VALUE, "cotangents: unknown framebuffer '%s'", name);
    struct vkb_image_row row = {
        // Half floats come from arrays on the device.
        .format = level->format == VKB_FORMAT_RGBA16_FLOAT ? VKB_FORMAT_RGBA16_FLOAT
                                                           : VKB_FORMAT_RGBA32_FLOAT,
        .width = adjoint->graph->images[image].width,
        .height = adjoint->graph->images[image].height,
        .input = (enum vkb_input_kind)(VKB_INPUT_LEVEL + number),
    };
    snprintf(row.name, sizeof row.name, "cotangents_%u", number);
    if (level->format != row.format || level->size.width != row.width
        || level->size.height != row.height)
        return vkb_fail(error, VKB_ERROR_VALUE,
                        "cotangents: %s is of another size or format than its framebuffer", name);
    return vkb_graph_add_image(adjoint->graph, &row, &adjoint->cotangents[image], error);
}

// The image of the weights, which are complete when all passes are there.
static bool add_table(struct vkb_adjoint *adjoint, struct vkb_error *error)
{
    const struct vkb_image_row row = {
        .name = "adjoint_weights",
        .format = VKB_FORMAT_RGBA32_FLOAT,
        .width = TABLE_WIDTH,
        .height = 1,
        .serial = 1,
    };

    return vkb_graph_add_image(adjoint->graph, &row, &adjoint->table_image, error);
}

// Adds the adjoint passes, from the last pass to the first.
static bool add_passes(struct vkb_adjoint *adjoint, const struct vkb_settings *settings,
                       bool *possible, struct vkb_error *error)
{
    for (uint32_t i = adjoint->graph->pass_count; *possible && i-- > 0;) {
        const struct vkb_pass_row pass = adjoint->graph->passes[i];
        vkb_transpose *transpose = transposes[pass.block];
        if (pass.target_count != 1 || vkb_cotangent_of(adjoint, &pass) == VKB_NO_IMAGE)
            continue;
        const bool convolved = pass.block == VKB_BLOCK_fft;
        *possible = convolved || transpose;
        if (convolved ? !vkb_transpose_convolution(adjoint, settings, &pass, error)
                      : transpose && !transpose(adjoint, &pass, error))
            return false;
    }
    return !*possible || vkb_end_scene(adjoint, error);
}

// Finds a threshold pass that only removes NaN and infinity, if all cotangents are of the final
// image: those of a bloom buffer have an alpha, which this pass would remove.
static void find_glow(struct vkb_adjoint *adjoint, const struct vkb_cotangents *cotangents)
{
    const struct vkb_graph *graph = adjoint->graph;

    if (cotangents->count != 1 || strcmp(cotangents->names[0], "final") != 0)
        return;
    for (uint32_t i = 0; i < graph->pass_count; ++i)
        if (vkb_is_threshold(&graph->passes[i])
            && graph->passes[i].constants.threshold_mode == THRESHOLD_NONE) {
            adjoint->glow = graph->passes[i].targets[0];
            adjoint->image = graph->passes[i].reads[SLOT_SOURCE];
        }
}

// Whether "final" alone has cotangents, and adds the bloom times the intensity, which is linear in
// what the only threshold pass writes, by a knee. Then the threshold's sum has the derivative by
// the intensity, too, and needs no bloom: a step of Separable that learns threshold and intensity
// took 1.06 ms of passes with the composite's, and 0.49 without (H200, 3840 x 2160, 2026-11-29).
static bool scales_light(const struct vkb_graph *graph, const struct vkb_cotangents *cotangents)
{
    uint32_t thresholds = 0, knees = 0, composites = 0;

    for (uint32_t i = 0; i < graph->pass_count; ++i) {
        const struct vkb_pass_row *pass = &graph->passes[i];
        const bool adds = pass->block == VKB_BLOCK_composite && vkb_adds_bloom(pass);
        thresholds += pass->block == VKB_BLOCK_threshold;
        knees +=
            pass->block == VKB_BLOCK_threshold && pass->constants.threshold_mode == THRESHOLD_KNEE;
        composites += adds;
        if (!adds && pass->block != VKB_BLOCK_threshold && pass->block != VKB_BLOCK_filter
            && pass->block != VKB_BLOCK_fft && pass->block != VKB_BLOCK_fft_kernel)
            return false;
    }
    return thresholds == 1 && knees == 1 && composites == 1 && cotangents->count == 1
        && strcmp(cotangents->names[0], "final") == 0;
}

// Sets which sums are computed for those that are wanted.
static void choose_sums(struct vkb_adjoint *adjoint, const struct vkb_cotangents *cotangents)
{
    struct vkb_wanted_sums *sums = &adjoint->sums;

    *sums = cotangents->sums;
    adjoint->light = scales_light(adjoint->graph, cotangents);
    *(adjoint->light ? &sums->threshold : &sums->composite) |= sums->intensity;
}

// Makes the cotangents of the source's images framebuffers. A custom method may have framebuffers
// of these names, too.
static bool show_results(struct vkb_adjoint *adjoint, uint32_t image_count, struct vkb_error *error)
{
    static const char *const names[VKB_INPUT_COUNT] = {
        [VKB_INPUT_IMAGE] = ".by_image",
        [VKB_INPUT_EMISSION] = ".by_emission",
        [VKB_INPUT_MASK] = ".by_mask",
    };
    bool done = true;

    for (uint32_t i = 0; done && i < image_count; ++i) {
        const struct vkb_image_row *forward = &adjoint->graph->images[i];
        const uint32_t cotangents = adjoint->cotangents[i];
        // What calls before have made is a constant.
        if (!names[forward->input] || cotangents == VKB_NO_IMAGE)
            continue;
        adjoint->graph->images[cotangents].channels =
            forward->input == VKB_INPUT_MASK ? 1 : forward->channels;
        done = vkb_graph_show_image(adjoint->graph, cotangents, names[forward->input], error);
    }
    return done;
}

bool vkb_build_adjoint(const struct vkb_source *source, const struct vkb_settings *settings,
                       const struct vkb_cotangents *cotangents, uint32_t max_side,
                       struct vkb_transposes *transposes, struct vkb_graph *graph, uint32_t *first,
                       bool *possible, struct vkb_error *error)
{
    struct vkb_adjoint adjoint = {
        .graph = graph,
        .table = {.transposes = transposes, .hash = VKB_HASH_START},
        .max_side = max_side,
        .weights = cotangents->weights,
        .lights = VKB_NO_IMAGE,
        .alpha = settings->choices[VKB_CHOICE_alpha],
        .scene = VKB_NO_IMAGE,
        .glow = VKB_NO_IMAGE,
        .image = VKB_NO_IMAGE,
    };

    graph->keeps_unmoved =
        cotangents->sums.enlarging || cotangents->sums.reducing || cotangents->sums.weight;
    if (!vkb_source_build(source, settings, max_side, graph, error))
        return false;
    find_glow(&adjoint, cotangents);
    // It is the last pass that adds up images.
    for (uint32_t i = 0; vkb_has_glare(settings) && i < graph->pass_count; ++i)
        if (graph->passes[i].shader == &vkb_shader_gather_frag)
            adjoint.lights = graph->passes[i].targets[0];
    choose_sums(&adjoint, cotangents);
    const uint32_t image_count = *first = graph->image_count;
    adjoint.cotangents = vkb_alloc(error, image_count, sizeof *adjoint.cotangents);
    bool done = adjoint.cotangents && add_table(&adjoint, error);
    for (uint32_t i = 0; adjoint.cotangents && i < image_count; ++i)
        adjoint.cotangents[i] = VKB_NO_IMAGE;
    for (uint32_t i = 0; done && i < cotangents->count; ++i)
        done = add_cotangents(&adjoint, source, cotangents, i, error);
    *possible = true;
    done = done && add_passes(&adjoint, settings, possible, error)
        && vkb_table_end(&adjoint.table, graph, adjoint.table_image, error)
        && (!cotangents->images || show_results(&adjoint, image_count, error));
    vkb_table_destroy(&adjoint.table);
    vkb_free(adjoint.cotangents);
    return done;
}
