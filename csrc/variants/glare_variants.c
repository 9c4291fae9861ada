// Variants of the stages of glare.
#include "variants/variant.h"

#include <string.h>

static const struct vkb_shader *const streaks_shaders[VKB_FORMAT_COUNT] =
    VKB_LINEAR_BY_FORMAT(streaks);

bool vkb_add_streaks_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    const enum vkb_format format = choice->graph->images[pass->targets[0]].format;
    struct vkb_pass_row row;

    if (!(vkb_computes(pass, VKB_BLOCK_streaks) && !pass->params.streaks.reads_next
          && vkb_fits_linear(choice, pass)
          && vkb_has_format_of(choice->graph, pass->reads[SLOT_SOURCE], pass->targets[0])))
        return false;
    memcpy(&row, pass, sizeof row);
    row.constants.sampling = 0;
    row.constants.tap_count = pass->params.streaks.count;
    vkb_make_linear(&row, streaks_shaders[format], STREAK_COLUMNS, STREAK_ROWS);
    return vkb_add_variant_pass(choice, &row);
}

// The sun is a place of the image between its texels.
static bool has_sun(const struct vkb_sun_beams_params *params, const struct vkb_image_row *image)
{
    const float x = params->sun_x * (float)image->width - 0.5f;
    const float y = params->sun_y * (float)image->height - 0.5f;

    return x >= 0.0f && y >= 0.0f && x <= (float)image->width - 1.0f
        && y <= (float)image->height - 1.0f;
}

bool vkb_add_beams_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    const struct vkb_image_row *image = &choice->graph->images[pass->targets[0]];
    const uint32_t width = image->width, height = image->height;
    // Lines of a side are as many as its rows, but for those that begin outside of the image, and
    // no more than twice its columns.
    const uint32_t across = width < 2 * height ? width : 2 * height;
    const uint32_t down = height < 2 * width ? height : 2 * width;
    const uint32_t lines = (across > down ? across : down) + 3 * BEAM_PIXELS;
    const struct vkb_shader *shader =
        image->format == VKB_FORMAT_RGBA16_FLOAT   ? &vkb_shader_beam_lines_linear_rgba16float
        : image->format == VKB_FORMAT_RGBA32_FLOAT ? &vkb_shader_beam_lines_linear_rgba32float
                                                   : NULL;
    struct vkb_pass_row row;

    if (!(shader && pass->shader == &vkb_shader_sun_beams_frag && !pass->constants.jittered
          && pass->constants.alpha != ALPHA_BLUR && has_sun(&pass->params.sun_beams, image)
          && vkb_fits_linear(choice, pass)
          // One storage buffer has all rows.
          && (uint64_t)(width + VKB_WORD_SIZE) * height * VKB_WORD_SIZE
                 <= choice->device->limits.maxStorageBufferRange
          && vkb_has_format_of(choice->graph, pass->reads[SLOT_SOURCE], pass->targets[0])
          && vkb_has_format_of(choice->graph, pass->reads[SLOT_DARK], pass->targets[0])))
        return false;
    memcpy(&row, pass, sizeof row);
    vkb_make_linear(&row, shader, 1, height);
    row.groups_width = (lines + ROW_INVOCATIONS - 1) / ROW_INVOCATIONS;
    // Those of two sides are no more than those of their columns, and one.
    row.groups_height = (width + height) / BEAM_PIXELS + 4;
    return vkb_add_variant_pass(choice, &row);
}
