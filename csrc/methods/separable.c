// The separable blur: layers that are added, each of them loops of a vertical and a horizontal
// pass; or the same kernel as one N x N pass.
#include "methods/methods.h"
#include "passes/blur.h"
#include "passes/levels.h"

#include <stdio.h>

// The row of a blur of a layer. Taps between texels use the sampler's filter in 8 bits. Float
// formats are filtered in the shader, since the samplers of some adapters keep only 8 bits of the
// position.
static struct vkb_pass_row blur_row(struct vkb_levels *levels, enum vkb_mode direction,
                                    uint32_t layer, double strength, uint32_t from, uint32_t to)
{
    const struct vkb_settings *settings = levels->settings;
    const struct vkb_image_row *read = &levels->graph->images[from];
    const double scale = settings->values.blur_scale * settings->layers[layer].scale;
    // A step of one texel in x is height / width texels in y.
    const bool width_steps = settings->choices[VKB_CHOICE_texel] == TEXEL_X;
    // The strength does not change the centre tap. If the taps start at 0, the centre is added
    // twice more, with the strength (as in the loop of the forward system's outline).
    const double side = settings->values.blur_strength;
    const double centre = settings->values.first_tap ? 1.0 : 1.0 + 2.0 * side;
    struct vkb_kernel kernel = {.count = settings->weight_count, .step = scale};
    struct vkb_filter filter;

    for (uint32_t tap = 0; tap < kernel.count; ++tap)
        kernel.weights[tap] = (tap ? side : centre) * settings->weights[tap];
    vkb_filter_begin(levels->graph, from, to, &filter);
    filter.gain = strength;
    if (direction != DIRECTION_VERTICAL)
        filter.x.kernel = kernel;
    if (width_steps)
        kernel.step = scale * read->height / read->width;
    if (direction != DIRECTION_HORIZONTAL)
        filter.y.kernel = kernel;
    return vkb_blur_row(levels, &filter, levels->source->format == VKB_FORMAT_RGBA8_UNORM, from,
                        to);
}

// Adds a pass to an intermediate image between the glow and the bloom; `columns` is the row of the
// pass along columns before one along rows. Returns its row.
static struct vkb_pass_row add_step(struct vkb_levels *levels, const char *name, bool framebuffer,
                                    enum vkb_mode direction, uint32_t layer, uint32_t from,
                                    const struct vkb_pass_row *columns)
{
    const struct vkb_bloom_source *source = levels->source;
    const uint32_t to =
        vkb_levels_target(levels, name, source->format, source->buffers, framebuffer);
    struct vkb_pass_row row = blur_row(levels, direction, layer, 1.0, from, to);

    if (direction == DIRECTION_HORIZONTAL)
        vkb_join(levels, columns, &row);
    vkb_levels_pass(levels, &row);
    return row;
}

// Adds all passes of a layer except the last one. Returns the image that the last one reads, and in
// *columns the row of the pass along columns before it, if it is along rows.
static uint32_t add_layer(struct vkb_levels *levels, uint32_t layer, struct vkb_pass_row *columns)
{
    const struct vkb_settings *settings = levels->settings;
    const int loops = settings->values.loops;
    const bool direct = settings->values.direct;
    const bool last_layer = layer + 1 == settings->layer_count;
    char name[VKB_NAME_SIZE];
    uint32_t image = levels->source->glow;

    for (int loop = 0; loop < loops; ++loop) {
        const bool last = loop + 1 == loops;
        const bool shown = last && last_layer;
        const uint8_t l = (uint8_t)layer, k = (uint8_t)loop;  // both are far below 256
        if (shown)
            snprintf(name, sizeof name, "blur_vertical");
        else
            snprintf(name, sizeof name, "blur_vertical_%u_%u", l, k);
        if (!direct) {
            *columns = add_step(levels, name, shown, DIRECTION_VERTICAL, layer, image, NULL);
            image = columns->targets[0];
        }
        snprintf(name, sizeof name, "%s_%u_%u", direct ? "blur" : "blur_horizontal", l, k);
        if (!last)
            image = add_step(levels, name, false, direct ? DIRECTION_BOTH : DIRECTION_HORIZONTAL,
                             layer, image, columns)
                        .targets[0];
    }
    return image;
}

// Adds a pass that copies `from` to `to`, which has another format.
static void add_rounding(struct vkb_levels *levels, uint32_t from, uint32_t to)
{
    const struct vkb_image_row *target = &levels->graph->images[to];
    struct vkb_pass_row row = vkb_fullscreen_row(target->name, &vkb_shader_threshold_frag, to);

    row.constants.threshold_mode = THRESHOLD_NONE;
    row.constants.sampling = SAMPLING_TEXEL;
    vkb_read_only(&row, from);
    vkb_apply_mask(&row, VKB_NO_IMAGE);
    row.block = VKB_BLOCK_threshold;
    VKB_SET_TARGET(&row, threshold, target);
    vkb_levels_pass(levels, &row);
}

uint32_t vkb_add_separable_method(struct vkb_levels *levels)
{
    const struct vkb_settings *settings = levels->settings;
    const struct vkb_bloom_source *source = levels->source;
    // Blending does not round as the shaders do, so such layers are added in a separate image.
    const bool apart = vkb_formats[source->format].rounded && settings->layer_count > 1;
    const enum vkb_format format = apart ? VKB_FORMAT_RGBA32_FLOAT : source->format;
    const bool direct = settings->values.direct;
    struct vkb_pass_row columns[MAX_LAYERS];
    uint32_t ends[MAX_LAYERS];

    for (uint32_t layer = 0; layer < settings->layer_count; ++layer)
        ends[layer] = add_layer(levels, layer, &columns[layer]);
    const uint32_t sum =
        vkb_levels_target(levels, apart ? "layers" : "bloom", format, source->final, !apart);
    // The last passes of the layers are consecutive, so they share a render pass, in which blending
    // adds them.
    for (uint32_t layer = 0; layer < settings->layer_count; ++layer) {
        struct vkb_pass_row row =
            blur_row(levels, direct ? DIRECTION_BOTH : DIRECTION_HORIZONTAL, layer,
                     settings->layers[layer].strength, ends[layer], sum);
        if (settings->layer_count == 1)
            snprintf(row.name, sizeof row.name, "bloom");
        else
            snprintf(row.name, sizeof row.name, "bloom_%u", layer);
        if (!direct)
            vkb_join(levels, &columns[layer], &row);
        // Blending does not clamp, and sums of the largest single floats must not overflow. (Half
        // floats have their complete range: the composite clamps a sum that overflows.)
        if (format == VKB_FORMAT_RGBA32_FLOAT)
            row.constants.emitters = (int)settings->layer_count;
        row.blend = layer == 0          ? VKB_BLEND_NONE
                  : source->blurs_alpha ? VKB_BLEND_ADD_RGBA
                                        : VKB_BLEND_ADD;
        vkb_levels_pass(levels, &row);
    }
    if (!apart)
        return sum;
    const uint32_t bloom = vkb_levels_image(levels, source->final, "bloom");
    add_rounding(levels, sum, bloom);
    return bloom;
}
