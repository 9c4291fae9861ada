// Glare beside the bloom: stages that read what glows and add light to the bloom.
//
// They read the thresholded and masked image, halved as often as each of them says. Published
// methods apply threshold and mask later, so that there a pass of its own makes this image. The
// bloom, times its intensity, and all stages are added up to the image that the composite reads in
// place of the bloom.
#include "methods/methods.h"
#include "passes/levels.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

// A stage that is being added.
struct stage {
    const struct vkb_stage *settings;
    struct vkb_levels levels;  // for its images
    char name[VKB_NAME_SIZE];
    uint32_t from;
};

typedef uint32_t add_stage(struct stage *stage);
static add_stage add_streaks, add_flare, add_dirt;
#define add_ghosts add_flare
#define add_halo   add_flare

static const struct {
    const char *name;
    add_stage *add;
} kinds[VKB_STAGE_COUNT] = {
#define STAGE_ROW(constant, name) [VKB_STAGE_##constant] = {#name, add_##name},
    VKB_STAGES(STAGE_ROW)
#undef STAGE_ROW
};

// The weights of iteration i: f^(k base^i) for tap k, all divided by their sum, times a gain. Of
// each tap but the first two channels, which alternate, are less.
static void set_weights(const struct vkb_glare_values *values, int iteration, double gain,
                        struct vkb_streaks_params *params)
{
    const double fade = pow(values->fade, pow(values->base, iteration));
    const double less = 1.0 - pow(values->colour_shift, iteration + 1);
    double sum = 0.0;

    for (int tap = 0; tap < values->base; ++tap)
        sum += pow(fade, tap);
    for (int tap = 0; tap < values->base; ++tap) {
        const double weight = gain * pow(fade, tap) / sum;
        const int kept = (4 - tap % 3) % 3;  // red, then blue, then green
        for (int channel = 0; channel < 4; ++channel)
            params->weights[tap][channel] =
                (float)(tap == 0 || channel == kept || channel == 3 ? weight : weight * less);
    }
    params->count = values->base;
}

// A step along an axis has no part across it: a cosine of a right angle is not quite 0.
static float step_of(double step)
{
    return fabs(step) < 1e-9 ? 0.0f : (float)step;
}

// Lets a pass add the image `before` to its result, if there is one.
static void add_before(struct vkb_pass_row *row, uint32_t before)
{
    vkb_read_at(row, SLOT_BEFORE, before);
    row->constants.adds_image = before != VKB_NO_IMAGE;
}

void vkb_add_ray_pass(struct vkb_levels *levels, const struct vkb_ray *ray)
{
    const struct vkb_glare_values *values = ray->values;
    const double step = values->length * pow(values->base, ray->iteration);
    struct vkb_pass_row row =
        vkb_fetching_row(levels, &vkb_shader_streaks_frag, ray->from, ray->to);
    struct vkb_streaks_params *params = &row.params.streaks;

    add_before(&row, ray->before);
    row.constants.part_above = ray->iteration == 0 && values->threshold > 0.0f;
    row.block = VKB_BLOCK_streaks;
    set_weights(values, ray->iteration, ray->gain, params);
    // Light goes in the direction of the angle, so that it comes from the other one.
    params->step_x = step_of(-step * cos(ray->angle));
    params->step_y = step_of(step * sin(ray->angle));
    params->threshold = ray->iteration == 0 ? values->threshold : 0.0f;
    params->reads_next = ray->next != NULL;
    if (ray->next)
        memcpy(params->next, ray->next, sizeof params->next);
    vkb_levels_pass(levels, &row);
}

// The framebuffer of a stage.
static uint32_t add_end(struct stage *stage)
{
    return vkb_levels_image(&stage->levels, vkb_size_of(stage->levels.graph, stage->from), "%s",
                            stage->name);
}

// Each ray is iterated by itself; its last iteration adds the rays before.
static uint32_t add_streaks(struct stage *stage)
{
    const struct vkb_glare_values *values = &stage->settings->values;
    // One direction is a line to both sides.
    const int rays = values->directions == 1 ? 2 : values->directions;
    uint32_t image = VKB_NO_IMAGE, before = VKB_NO_IMAGE;

    for (int ray = 0; ray < rays; ++ray) {
        uint32_t from = stage->from;
        for (int iteration = 0; iteration < values->iterations; ++iteration) {
            const bool last = iteration == values->iterations - 1;
            char name[2 * VKB_NAME_SIZE];
            snprintf(name, sizeof name, "%s_%d_%d", stage->name, ray, iteration);
            image = last && ray == rays - 1
                      ? add_end(stage)
                      : vkb_levels_step(&stage->levels,
                                        vkb_size_of(stage->levels.graph, stage->from), "%s", name);
            const struct vkb_ray row = {
                .values = values,
                .angle = acos(-1.0) * (values->angle / 180.0 + 2.0 * ray / rays),
                .gain = last ? 1.0 / rays : 1.0,
                .iteration = iteration,
                .from = from,
                .before = last ? before : VKB_NO_IMAGE,
                .to = image,
            };
            vkb_add_ray_pass(&stage->levels, &row);
            from = image;
        }
        before = image;
    }
    return image;
}

void vkb_add_flare_pass(struct vkb_levels *levels, const struct vkb_stage *stage, uint32_t from,
                        uint32_t before, uint32_t to)
{
    const struct vkb_glare_values *values = &stage->values;
    const bool ghosts = stage->kind == VKB_STAGE_GHOSTS;
    struct vkb_pass_row row = vkb_fetching_row(
        levels, ghosts ? &vkb_shader_ghosts_frag : &vkb_shader_halo_frag, from, to);

    if (ghosts)
        add_before(&row, before);
    row.constants.part_above = values->threshold > 0.0f;
    row.constants.aberrated = values->aberration > 0.0f;
    row.block = VKB_BLOCK_flare;
    row.params.flare = (struct vkb_flare_params){
        .threshold = values->threshold,
        .maximum = values->maximum,
        .aberration = values->aberration,
        .radius = values->radius,
        .falloff = values->falloff,
        .vignette = values->vignette,
        .width = values->width,
        .count = (int)stage->ghost_count,
    };
    memcpy(row.params.flare.ghosts, stage->ghosts, sizeof row.params.flare.ghosts);
    vkb_levels_pass(levels, &row);
}

// A stage of one pass with the block of ghosts and halo.
static uint32_t add_flare(struct stage *stage)
{
    const uint32_t image = add_end(stage);

    vkb_add_flare_pass(&stage->levels, stage->settings, stage->from, VKB_NO_IMAGE, image);
    return image;
}

// Dirt has no image of its own.
static uint32_t add_dirt(struct stage *stage)
{
    (void)stage;
    return VKB_NO_IMAGE;
}

bool vkb_has_glare(const struct vkb_settings *settings)
{
    return settings->values.bloom && settings->stage_count > 0;
}

// What the stages read: the glow, or in published methods what the threshold and the mask leave of
// it.
static uint32_t add_source(struct vkb_levels *levels)
{
    const struct vkb_settings *settings = levels->settings;
    const struct vkb_bloom_source *source = levels->source;

    if (!vkb_method_of(settings)->published
        || (!vkb_stages_have_threshold(settings) && source->mask == VKB_NO_IMAGE))
        return source->glow;
    const uint32_t image = vkb_levels_step(levels, source->buffers, "glare_source");
    vkb_add_stage_threshold_pass(levels, source->glow, source->mask, image);
    return image;
}

// Adds images of half the size, until there are as many as the stage wants.
static void add_halvings(struct vkb_levels *levels, int halvings, uint32_t *images, int *count)
{
    for (; *count <= halvings; ++*count) {
        const uint32_t from = images[*count - 1];
        const struct vkb_size size = vkb_halved(vkb_size_of(levels->graph, from));
        images[*count] = vkb_levels_step(levels, size, "glare_down_%u", (uint32_t)*count - 1);
        vkb_levels_reduce(levels, 1.0, 1.0, from, images[*count]);
    }
}

// The framebuffer of stage `index`: its kind, with a number where there are several of it.
static void name_stage(const struct vkb_settings *settings, uint32_t index, char *name)
{
    const enum vkb_stage_kind kind = settings->stages[index].kind;
    uint32_t number = 0, count = 0;

    for (uint32_t i = 0; i < settings->stage_count; ++i) {
        count += settings->stages[i].kind == kind;
        number += i < index && settings->stages[i].kind == kind;
    }
    if (count == 1)
        vkb_set_name(name, VKB_NAME_SIZE, kinds[kind].name);
    else
        snprintf(name, VKB_NAME_SIZE, "%s_%u", kinds[kind].name, number);
}

void vkb_add_glare_stages(struct vkb_levels *levels, uint32_t *stages)
{
    const struct vkb_settings *settings = levels->settings;
    struct vkb_bloom_source floats = *levels->source;
    struct stage stage = {.levels = *levels};
    uint32_t images[MAX_HALVINGS + 1];
    int count = 1;

    // A streak spreads a pixel over hundreds: 8 bits and 6 bits of mantissa hold too little.
    if (floats.format != VKB_FORMAT_RGBA32_FLOAT)
        floats.format = VKB_FORMAT_RGBA16_FLOAT;
    stage.levels.source = &floats;
    images[0] = add_source(&stage.levels);
    for (uint32_t i = 0; i < settings->stage_count; ++i) {
        stage.settings = &settings->stages[i];
        name_stage(settings, i, stage.name);
        const bool is_dirt = stage.settings->kind == VKB_STAGE_DIRT;
        const int halvings = is_dirt ? 0 : stage.settings->values.halvings;
        add_halvings(&stage.levels, halvings, images, &count);
        stage.from = images[halvings];
        stages[i] = kinds[stage.settings->kind].add(&stage);
    }
    levels->failed = stage.levels.failed;
}

// Adds the picture of dirt and the pass that multiplies the light by it. Returns its image.
static uint32_t add_dirty_light(struct vkb_levels *levels, const struct vkb_glare_values *values,
                                uint32_t light)
{
    const struct vkb_image_row picture = vkb_given_image("dirt", &levels->settings->dirt);
    const uint32_t dirt = vkb_levels_add(levels, &picture);
    const uint32_t dirty = vkb_levels_step(levels, levels->source->final, "dirty_light");
    struct vkb_pass_row row = vkb_fetching_row(levels, &vkb_shader_dirt_frag, light, dirty);

    vkb_read_at(&row, SLOT_DIRT, dirt);
    row.block = VKB_BLOCK_dirt;
    row.params.dirt = (struct vkb_dirt_params){
        .base = values->lerp ? 1.0f - values->strength : 0.0f,
        .share = values->strength,
    };
    VKB_SET_TARGET(&row, dirt, &levels->graph->images[dirty]);
    vkb_levels_pass(levels, &row);
    return dirty;
}

uint32_t vkb_add_light_passes(struct vkb_levels *method, const uint32_t *stages, uint32_t bloom)
{
    const struct vkb_settings *settings = method->settings;
    struct vkb_bloom_source floats = *method->source;
    struct vkb_levels levels = *method;
    double shares[MAX_STAGES + 1] = {0.0};
    const struct vkb_glare_values *dirt = NULL;

    // Then there may be no bloom, nor stages.
    if (method->failed)
        return 0;
    // Not rounded where the bloom's buffers are coarse: the composite rounds.
    if (vkb_end_format(settings, floats.format) != VKB_FORMAT_RGBA16_FLOAT)
        floats.format = VKB_FORMAT_RGBA32_FLOAT;
    levels.source = &floats;
    levels.count = 0;
    if (bloom != VKB_NO_IMAGE) {
        shares[0] = settings->values.intensity;
        levels.downs[levels.count++] = bloom;
    }
    for (uint32_t i = 0; i < settings->stage_count; ++i) {
        if (settings->stages[i].kind == VKB_STAGE_DIRT) {
            dirt = &settings->stages[i].values;
            continue;
        }
        shares[levels.count] = settings->stages[i].values.intensity;
        levels.downs[levels.count++] = stages[i];
    }
    if (levels.count == 0) {
        method->failed = method->failed
                      || !vkb_fail(levels.error, VKB_ERROR_VALUE,
                                   "glare: dirt has no light that it multiplies; add a stage that "
                                   "gives light, or save a bloom");
        return VKB_NO_IMAGE;
    }
    uint32_t light = vkb_levels_step(&levels, floats.final, "light");
    vkb_levels_gather(&levels, shares, UPSAMPLE_LINEAR, light);
    if (dirt)
        light = add_dirty_light(&levels, dirt, light);
    method->failed = levels.failed;
    return light;
}
