// Passes on the host, where images are in its memory. They read and write single floats.
#include "passes/host_beams.h"
#include "passes/host_ghosts.h"
#include "variants/variant.h"

#include <stdio.h>
#include <string.h>

static const struct vkb_shader *const glow_shaders[VKB_FORMAT_COUNT] =
    VKB_LINEAR_BY_FORMAT(host_pixels);
static const struct vkb_shader *const stored_shaders[VKB_FORMAT_COUNT] =
    VKB_BY_FORMAT(host_pixels_stored);

// The pass that makes single floats of a glow (STAGE_FIRST), or stores them (STAGE_LAST).
static bool add_pixels(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                       int32_t stage, uint32_t from, uint32_t to)
{
    const struct vkb_image_row *images = choice->graph->images;
    const bool last = stage == STAGE_LAST;
    struct vkb_pass_row row = vkb_fullscreen_row(
        pass->name, last ? stored_shaders[images[to].format] : glow_shaders[images[from].format],
        to);

    vkb_read_only(&row, from);
    vkb_make_linear(&row, row.shader, 1, TEXEL_ROWS);
    row.constants.stage = stage;
    row.constants.alpha = pass->constants.alpha;
    row.block = VKB_BLOCK_fft;
    if (pass->constants.prefiltered) {
        row.constants.prefiltered = pass->constants.prefiltered;
        row.params.fft.prefilter_min = pass->params.fft.prefilter_min;
        row.params.fft.prefilter_max = pass->params.fft.prefilter_max;
        row.params.fft.prefilter_factor = pass->params.fft.prefilter_factor;
    }
    return vkb_add_variant_pass(choice, &row);
}

// An image of single floats for another one. True: it is new.
static bool add_floats(struct vkb_variant_choice *choice, uint32_t of, uint32_t *floats)
{
    const struct vkb_image_row *row = &choice->graph->images[of];
    const struct vkb_size size = vkb_size_of(choice->graph, of);
    char name[VKB_NAME_SIZE];

    snprintf(name, sizeof name, "%cfloats_of_%.*s", VKB_INTERNAL_NAME, VKB_NAME_SIZE - 12,
             row->name);
    *floats = vkb_graph_find(choice->graph, name);
    if (*floats != VKB_NO_IMAGE)
        return false;
    *floats = vkb_add_float_image(choice, name + 1, size);
    return !choice->failed;
}

static bool is_single_float(const struct vkb_variant_choice *choice, uint32_t image)
{
    return choice->graph->images[image].format == VKB_FORMAT_RGBA32_FLOAT;
}

void vkb_read_host_floats(struct vkb_variant_choice *choice, struct vkb_pass_row *row)
{
    const uint32_t source = row->reads[SLOT_SOURCE];
    uint32_t floats;

    if (!row->constants.prefiltered && is_single_float(choice, source))
        return;
    if (add_floats(choice, source, &floats))
        add_pixels(choice, row, STAGE_FIRST, source, floats);
    row->reads[SLOT_SOURCE] = floats;
}

static bool run_on_host(struct vkb_variant_choice *choice, struct vkb_pass_row *row,
                        vkb_host_pass *host)
{
    static const struct vkb_shader shader = {.name = "host"};

    vkb_make_linear(row, &shader, 1, 1);
    row->host = host;
    row->vertex = NULL;
    return vkb_add_variant_pass(choice, row);
}

bool vkb_add_host_pass(struct vkb_variant_choice *choice, struct vkb_pass_row *row,
                       vkb_host_pass *host)
{
    const struct vkb_pass_row last = *row;
    const bool stores = is_single_float(choice, row->targets[0]);

    if (!stores) {
        row->constants.stage = 0;
        add_floats(choice, last.targets[0], &row->targets[0]);
    }
    return run_on_host(choice, row, host)
        && (stores || add_pixels(choice, &last, STAGE_LAST, row->targets[0], last.targets[0]));
}

bool vkb_add_host_beams_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    const struct vkb_image_row *image = &choice->graph->images[pass->targets[0]];
    struct vkb_pass_row row;

    if (pass->shader != &vkb_shader_sun_beams_frag || !vkb_fits_linear(choice, pass)
        || !vkb_image_fits_linear_texels(choice->device, VKB_FORMAT_RGBA32_FLOAT, image->width,
                                         image->height))
        return false;
    memcpy(&row, pass, sizeof row);
    vkb_read_host_floats(choice, &row);
    return vkb_add_host_pass(choice, &row, vkb_host_sun_beams);
}

bool vkb_add_host_ghosts_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    const struct vkb_image_row *images = choice->graph->images;
    const uint32_t target = pass->targets[0], source = pass->reads[SLOT_SOURCE];
    struct vkb_pass_row row;

    if (pass->shader != &vkb_shader_ghosts_frag || !vkb_fits_linear(choice, pass)
        || images[target].format != VKB_FORMAT_RGBA16_FLOAT || images[target].width < 2
        || !vkb_has_format_of(choice->graph, source, target) || !vkb_host_has_ghosts(pass))
        return false;
    memcpy(&row, pass, sizeof row);
    return run_on_host(choice, &row, vkb_host_show_ghosts);
}
