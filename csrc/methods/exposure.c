// Exposures: a meter of the frame, what the exposure adapts to, and where its multipliers apply.
//
// The image "exposure" is one texel: the value adapted to, the multiplier of the light that the
// bloom reads, the multiplier of the picture with its bloom, and 1. Its history is the engine's
// state. What an engine meters is a histogram or a mean, which shaders know by its constant.
#include "methods/methods.h"

#include <stdio.h>
#include <string.h>

struct engine {
    uint32_t bins;   // of its histogram; 0: it has none
    uint32_t apart;  // of its samples, in pixels
    uint32_t exposes;
};

#define ENGINE_ROW(constant, value, name, bins, apart, exposes) [value] = {bins, apart, exposes},
static const struct engine engines[] = {EXPOSURES(ENGINE_ROW)};

static uint32_t ceiling(uint32_t a, uint32_t b)
{
    return (a + b - 1) / b;
}

static uint32_t at_least_one(uint32_t side)
{
    return side ? side : 1;
}

static uint32_t add_image(struct vkb_levels *levels, const char *name, struct vkb_size size,
                          bool framebuffer)
{
    return vkb_levels_target(levels, name, VKB_FORMAT_RGBA32_FLOAT, size, framebuffer);
}

static struct vkb_pass_row describe_pass(const struct vkb_levels *levels,
                                         const struct vkb_shader *shader, uint32_t from,
                                         uint32_t to)
{
    const struct vkb_settings *settings = levels->settings;
    struct vkb_pass_row row = vkb_fullscreen_row(levels->graph->images[to].name, shader, to);

    row.constants.engine = (int)settings->exposure_engine;
    row.block = VKB_BLOCK_exposure;
    memcpy(&row.params.exposure, settings->exposure_numbers, sizeof settings->exposure_numbers);
    vkb_read_only(&row, from);
    return row;
}

static void make_dispatch(struct vkb_pass_row *row, uint32_t across, uint32_t down)
{
    row->geometry = VKB_GEOMETRY_DISPATCH;
    row->vertex = NULL;
    row->variant = "dispatch";
    row->block_width = row->block_height = 1;
    row->groups_width = across;
    row->groups_height = down;
}

// The mask of the meter, or an image that stands for it, which is not read.
static uint32_t add_mask(struct vkb_levels *levels, uint32_t other)
{
    const struct vkb_kernel_data *data = &levels->settings->exposure_mask;
    const struct vkb_image_row mask = vkb_given_image("meter_mask", data);

    return data->serial ? vkb_levels_add(levels, &mask) : other;
}

static uint32_t add_histogram(struct vkb_levels *levels, uint32_t from, uint32_t mask)
{
    const struct engine *engine = &engines[levels->settings->exposure_engine];
    const struct vkb_size size = vkb_size_of(levels->graph, from);
    const uint32_t across = ceiling(ceiling(size.width, engine->apart), METER_TILE);
    const uint32_t down = ceiling(ceiling(size.height, engine->apart), METER_TILE);
    const struct vkb_size tiles = {across * engine->bins / 4, down}, bins = {engine->bins, 1};
    const uint32_t counts = add_image(levels, "histogram_tiles", tiles, false);
    const uint32_t histogram = add_image(levels, "histogram", bins, true);
    if (levels->failed)
        return 0;

    struct vkb_pass_row row = describe_pass(levels, &vkb_shader_histogram_comp, from, counts);
    make_dispatch(&row, across, down);
    vkb_read_at(&row, SLOT_METER_MASK, mask);
    vkb_levels_pass(levels, &row);
    row = describe_pass(levels, &vkb_shader_histogram_sum_comp, counts, histogram);
    make_dispatch(&row, engine->bins / 4, 1);
    vkb_levels_pass(levels, &row);
    return histogram;
}

// Adds a step of a mean. `of_logarithms`: samples are of those, and not of light.
static uint32_t add_step_of(struct vkb_levels *levels, int meter, bool of_logarithms, uint32_t from,
                            uint32_t mask, struct vkb_size size)
{
    char name[VKB_NAME_SIZE];

    snprintf(name, sizeof name, "meter_%u", levels->graph->image_count);
    const uint32_t to = add_image(levels, name, size, false);
    if (levels->failed)
        return 0;
    struct vkb_pass_row row = describe_pass(levels, &vkb_shader_meter_frag, from, to);
    row.constants.meter = meter;
    row.params.exposure.width = (int)size.width;
    row.params.exposure.height = (int)size.height;
    row.params.exposure.channel = of_logarithms;
    vkb_read_at(&row, SLOT_METER_MASK, mask);
    vkb_levels_pass(levels, &row);
    return to;
}

static uint32_t add_step(struct vkb_levels *levels, int meter, uint32_t from, uint32_t mask,
                         struct vkb_size size)
{
    return add_step_of(levels, meter, false, from, mask, size);
}

// Adds sums of blocks, or means, until one texel is left. Godot leaves out what fills no block.
static uint32_t add_sums(struct vkb_levels *levels, int first, uint32_t from, uint32_t mask)
{
    const bool whole = levels->settings->exposure_engine == EXPOSURE_GODOT;
    int meter = first;

    while (!levels->failed) {
        struct vkb_size size = vkb_size_of(levels->graph, from);
        if (meter != METER_LIGHT && size.width == 1 && size.height == 1)
            return from;
        size.width =
            whole ? at_least_one(size.width / METER_BLOCK) : ceiling(size.width, METER_BLOCK);
        size.height =
            whole ? at_least_one(size.height / METER_BLOCK) : ceiling(size.height, METER_BLOCK);
        from = add_step(levels, meter, from, mask, size);
        meter = METER_SUM;
    }
    return from;
}

static struct vkb_size half_of(struct vkb_size size)
{
    return (struct vkb_size){ceiling(size.width, 2), ceiling(size.height, 2)};
}

// Returns the image of logarithms whose mean is Granite's.
static uint32_t add_logarithms(struct vkb_levels *levels, uint32_t from)
{
    enum { LEVELS = 4 };
    struct vkb_size size = half_of(vkb_size_of(levels->graph, from));
    uint32_t image = add_step(levels, METER_SAMPLES, from, from, size);

    for (int i = 0; i < LEVELS && !levels->failed; ++i) {
        size = half_of(size);
        image = add_step(levels, METER_LEVEL, image, from, size);
    }
    size = (struct vkb_size){at_least_one(size.width / 2), at_least_one(size.height / 2)};
    return add_step_of(levels, METER_SAMPLES, true, image, from, size);
}

// Adds what the engine meters in an image; `counted` gets the size of what sums are of.
static uint32_t add_meter(struct vkb_levels *levels, uint32_t from, struct vkb_size *counted)
{
    const struct vkb_size tiles = {METER_POINTS / METER_TILE_POINTS,
                                   METER_POINTS / METER_TILE_POINTS};
    const uint32_t engine = levels->settings->exposure_engine;

    *counted = vkb_size_of(levels->graph, from);
    if (engine == EXPOSURE_FIXED || engine == EXPOSURE_KEYFRAMED)
        return from;
    if (engines[engine].bins)
        return add_histogram(levels, from, add_mask(levels, from));
    if (engine == EXPOSURE_AUTOMATIC) {
        const uint32_t mask = add_mask(levels, from);
        return add_sums(levels, METER_SUM, add_step(levels, METER_LIGHT, from, mask, tiles), from);
    }
    if (engine != EXPOSURE_GRANITE)
        return add_sums(levels, METER_LIGHT, from, from);
    const uint32_t logarithms = add_logarithms(levels, from);
    if (!levels->failed)
        *counted = vkb_size_of(levels->graph, logarithms);
    return add_sums(levels, METER_SUM, logarithms, from);
}

bool vkb_exposure_has(const struct vkb_settings *settings, uint32_t what)
{
    return settings->exposure_engine && (engines[settings->exposure_engine].exposes & what);
}

uint32_t vkb_add_exposure(struct vkb_levels *levels, uint32_t metered)
{
    const struct vkb_settings *settings = levels->settings;
    const struct vkb_size one = {1, 1};
    struct vkb_size counted;

    if (levels->failed)
        return 0;
    const uint32_t measured = add_meter(levels, metered, &counted);
    const uint32_t exposure = add_image(levels, "exposure", one, true);
    const uint32_t history = vkb_levels_history(levels, exposure);
    if (levels->failed)
        return 0;
    struct vkb_pass_row row = describe_pass(levels, &vkb_shader_adapt_frag, measured, exposure);
    vkb_read_at(&row, SLOT_EXPOSURE, history);
    row.params.exposure.width = (int)counted.width;
    row.params.exposure.height = (int)counted.height;
    row.params.exposure.columns = (int)settings->exposure_key_count;
    memcpy(row.params.exposure.table, settings->exposure_table, sizeof settings->exposure_table);
    vkb_levels_pass(levels, &row);
    return exposure;
}

uint32_t vkb_add_exposed(struct vkb_levels *levels, const char *name, bool framebuffer,
                         uint32_t image, uint32_t exposure, bool after)
{
    if (levels->failed)
        return 0;
    const struct vkb_image_row *from = &levels->graph->images[image];
    struct vkb_image_row row = {
        .format = VKB_FORMAT_RGBA32_FLOAT,
        .width = from->width,
        .height = from->height,
        .channels = from->channels,
        .framebuffer = framebuffer,
    };
    vkb_set_name(row.name, sizeof row.name, name);
    const uint32_t exposed = vkb_levels_add(levels, &row);
    if (levels->failed)
        return 0;
    struct vkb_pass_row pass = describe_pass(levels, &vkb_shader_expose_frag, image, exposed);
    vkb_read_at(&pass, SLOT_EXPOSURE, exposure);
    pass.params.exposure.channel = after ? 2 : 1;
    vkb_levels_pass(levels, &pass);
    return exposed;
}
