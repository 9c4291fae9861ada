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
