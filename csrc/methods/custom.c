// A method whose passes were given at run time: each is a shader, the images that it reads by name,
// and the image that it writes.
#include "methods/methods.h"
#include "passes/levels.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

// The results that the core uses: the bloom, and the picture, which takes the place of the scene.
static const char BLOOM[] = "bloom", PICTURE[] = "main";

// Keeps the first failure.
#define FAIL(levels, ...) \
    ((levels)->failed = \
         (levels)->failed || !vkb_fail((levels)->error, VKB_ERROR_VALUE, __VA_ARGS__))

// The number of the first passes whose result has that name; `count` if none has it.
static uint32_t find_pass(const struct vkb_settings *settings, uint32_t count, const char *name)
{
    uint32_t pass = 0;

    while (pass < count && strcmp(settings->passes[pass].name, name) != 0)
        ++pass;
    return pass;
}

// The image of a name that pass `number` reads. Of others in the graph passes know no names.
static uint32_t find_read(const struct vkb_levels *levels, const uint32_t *images, uint32_t number,
                          const char *name)
{
    const uint32_t pass = find_pass(levels->settings, number, name);

    return strcmp(name, "MAIN") == 0 ? levels->source->scene
         : strcmp(name, "GLOW") == 0 ? levels->source->glow
         : pass < number             ? images[pass]
                                     : VKB_NO_IMAGE;
}

static bool is_free(const struct vkb_levels *levels, const char *name)
{
    const struct vkb_settings *settings = levels->settings;

    return vkb_graph_find(levels->graph, name) == VKB_NO_IMAGE
        && find_pass(settings, settings->pass_count, name) == settings->pass_count;
}

// Names the image of a pass. Where the graph has a framebuffer of that name, it is saved_NAME;
// where the method saves that, too, saved__NAME, which is no name of a texture.
static void name_image(const struct vkb_levels *levels, const struct vkb_custom_pass *pass,
                       vkb_image_name name)
{
    vkb_set_name(name, VKB_NAME_SIZE, pass->name);
    if (!pass->framebuffer || vkb_graph_find(levels->graph, name) == VKB_NO_IMAGE)
        return;
    snprintf(name, VKB_NAME_SIZE, "saved_%.25s", pass->name);
    if (!is_free(levels, name))
        snprintf(name, VKB_NAME_SIZE, "saved__%.24s", pass->name);
}

static bool has_size(const struct vkb_custom_pass *pass, struct vkb_size size)
{
    return pass->width == size.width && pass->height == size.height;
}

// A bloom that is enlarged afterwards is no framebuffer.
static bool is_enlarged(const struct vkb_levels *levels, const struct vkb_custom_pass *pass)
{
    return strcmp(pass->name, BLOOM) == 0 && !has_size(pass, levels->source->final);
}

// Adds the image that pass `number` writes, unless an earlier pass that reads its history has.
static void add_image(struct vkb_levels *levels, uint32_t *images, uint32_t number)
{
    const struct vkb_custom_pass *pass = &levels->settings->passes[number];
    const struct vkb_size size = {pass->width, pass->height};
    const bool enlarged = is_enlarged(levels, pass);
    vkb_image_name name;

    if (images[number] != VKB_NO_IMAGE)
        return;
    if (find_pass(levels->settings, number, pass->name) < number)
        FAIL(levels, "passes: there are two images named %s", pass->name);
    name_image(levels, pass, name);
    images[number] =
        vkb_levels_target(levels, enlarged ? "bloom_buffer" : name,
                          pass->format ? (enum vkb_format)pass->format : levels->source->format,
                          size, pass->framebuffer && !enlarged);
}

// The history of the framebuffer that a pass writes, maybe a later one.
static uint32_t find_history(struct vkb_levels *levels, uint32_t *images, const char *name)
{
    const struct vkb_settings *settings = levels->settings;
    const uint32_t number = find_pass(settings, settings->pass_count, name);

    if (number == settings->pass_count)
        return VKB_NO_IMAGE;
    if (is_enlarged(levels, &settings->passes[number]))
        FAIL(levels,
             "passes: the history of a %s that is smaller than the frame is not kept; save "
             "it under another name, too",
             BLOOM);
    add_image(levels, images, number);
    return vkb_levels_history(levels, images[number]);
}

// Adds the images of the rows after pass `number` that are joined to it as its targets.
static void add_targets(struct vkb_levels *levels, uint32_t *images, uint32_t number,
                        struct vkb_pass_row *row)
{
    const struct vkb_settings *settings = levels->settings;
    const struct vkb_custom_pass *pass = &settings->passes[number];

    for (uint32_t i = number + 1; i < settings->pass_count && settings->passes[i].joined; ++i) {
        if (row->target_count == VKB_MAX_TARGETS)
            FAIL(levels, "passes: %s writes more than %d images", pass->name, VKB_MAX_TARGETS);
        if (levels->failed)
            return;
        add_image(levels, images, i);
        row->targets[row->target_count++] = images[i];
    }
}

// Adds pass `number`. `images` has those of the passes before.
static void add_pass(struct vkb_levels *levels, uint32_t *images, uint32_t number)
{
    const struct vkb_custom_pass *pass = &levels->settings->passes[number];

    add_image(levels, images, number);
    const char *name = vkb_graph_label(levels->graph, levels->graph->images[images[number]].name);
    struct vkb_pass_row row = vkb_fullscreen_row(name, pass->shader, images[number]);
    for (; row.read_count < pass->read_count; ++row.read_count) {
        const char *read = pass->reads[row.read_count];
        const uint32_t found = pass->histories >> row.read_count & 1
                                 ? find_history(levels, images, read)
                                 : find_read(levels, images, number, read);
        if (found == VKB_NO_IMAGE)
            FAIL(levels, "passes: %s reads %s, which no pass before it writes", pass->name, read);
        row.reads[row.read_count] = found;
    }
    memcpy(row.sampling, pass->sampling, sizeof row.sampling);
    if (pass->vertex || pass->positions)
        row.vertex = pass->vertex ? pass->vertex : &vkb_shader_positions_vert;
    row.vertices = pass->vertices;
    // A vertex shader of its own may leave pixels out.
    if (pass->vertex)
        row.load = VKB_LOAD_CLEAR;
    add_targets(levels, images, number, &row);
    if (pass->block_width) {
        row.geometry = VKB_GEOMETRY_DISPATCH;
        row.vertex = NULL;
        row.block_width = pass->block_width;
        row.block_height = pass->block_height;
        row.groups_width = pass->groups_width;
        row.groups_height = pass->groups_height;
    }
    row.block = VKB_BLOCK_custom;
    row.params.custom = pass->params;
    row.resources = pass->resources;
    row.resource_count = pass->resource_count;
    row.turn = pass->turn;
    vkb_levels_pass(levels, &row);
}

// Adds all passes. Returns the bloom, if there is one.
static uint32_t add_passes(struct vkb_levels *levels, uint32_t *images)
{
    const struct vkb_settings *settings = levels->settings;
    const struct vkb_size final = levels->source->final;
    uint32_t bloom = VKB_NO_IMAGE;

    for (uint32_t i = 0; i < settings->pass_count; ++i)
        images[i] = VKB_NO_IMAGE;
    for (uint32_t i = 0; i < settings->pass_count; ++i) {
        const struct vkb_custom_pass *pass = &settings->passes[i];
        const bool is_bloom = strcmp(pass->name, BLOOM) == 0, fits = has_size(pass, final);
        const bool is_picture = strcmp(pass->name, PICTURE) == 0;
        if (!pass->joined)
            add_pass(levels, images, i);
        if (is_bloom)
            bloom = fits ? images[i] : vkb_levels_enlarge(levels, UPSAMPLE_LINEAR, images[i], 1.0);
        if (is_picture)
            levels->picture = images[i];
        if (is_picture && !fits)
            FAIL(levels, "passes: %s is %u x %u, which is not the frame's size, %u x %u", PICTURE,
                 pass->width, pass->height, final.width, final.height);
    }
    if (bloom == VKB_NO_IMAGE && !levels->picture)
        FAIL(levels, "passes: none writes %s or %s", BLOOM, PICTURE);
    return bloom;
}

uint32_t vkb_add_custom_method(struct vkb_levels *levels)
{
    uint32_t *images = vkb_alloc(levels->error, levels->settings->pass_count + 1, sizeof *images);
    const uint32_t bloom = images ? add_passes(levels, images) : VKB_NO_IMAGE;

    levels->failed = levels->failed || !images;
    vkb_free(images);
    return bloom;
}
