// Forms of a pyramid's levels that are exactly half or twice as large as the one before.
#include "variants/form.h"

#include <math.h>
#include <string.h>

static const enum vkb_shader halve_shaders[VKB_FORMAT_COUNT] = VKB_BY_FORMAT(halve_comp);
static const enum vkb_shader double_shaders[VKB_FORMAT_COUNT] = VKB_BY_FORMAT(double_comp);
static const enum vkb_shader double_final_shaders[VKB_FORMAT_COUNT] =
    VKB_BY_FORMAT(double_final_comp);

static bool is_twice(const struct vkb_graph *graph, uint32_t large, uint32_t small)
{
    return graph->images[large].width == 2 * graph->images[small].width
        && graph->images[large].height == 2 * graph->images[small].height;
}

static void load_in_strips(struct vkb_pass_row *row, enum vkb_shader shader, uint32_t columns,
                           uint32_t rows)
{
    vkb_make_dispatch(row, shader, ROW_INVOCATIONS * columns, rows);
    row->loads = true;
    memset(row->constants, 0, sizeof row->constants);
    row->constant_count = 0;
}

// Where the larger level is what is extracted of an image: from the image itself, as an alternative
// to `halving`, which `pass` became.
static bool add_halved_image(const struct vkb_form_choice *choice, const struct vkb_pass_row *pass,
                             const struct vkb_pass_row *halving, struct vkb_error *error)
{
    const struct vkb_pass_row *extract = vkb_extract_of(&choice->plain, pass->reads[0]);
    struct vkb_pass_row row;

    if (!extract)
        return true;
    memcpy(&row, halving, sizeof row);
    row.reads[0] = extract->reads[0];
    row.alternative = true;
    row.constants[0] = 1;
    row.constants[1] = extract->constants[0];
    row.constants[2] = vkb_stored_as[choice->plain.images[pass->reads[0]].format];
    row.constant_count = 3;
    row.params.pyramid.threshold = extract->params.extract.threshold;
    row.params.pyramid.knee = extract->params.extract.knee;
    return vkb_graph_add_pass(choice->graph, &row, error);
}

// The 13 taps from a level of exactly twice the size. Where fireflies are filtered the groups have
// weights of their own, so that the kernel does not fall apart into separable ones.
bool vkb_add_halved(const struct vkb_form_choice *choice, const struct vkb_pass_row *pass,
                    bool *fits, struct vkb_error *error)
{
    const struct vkb_graph *plain = &choice->plain;
    struct vkb_pass_row row;

    *fits = pass->shader == VKB_SHADER_pyramid_down_frag && pass->constants[1] == 0
         && is_twice(plain, pass->reads[0], pass->targets[0]);
    if (!*fits)
        return true;
    memcpy(&row, pass, sizeof row);
    load_in_strips(&row, halve_shaders[plain->images[pass->reads[0]].format], HALVE_COLUMNS,
                   HALVE_ROWS);
    return vkb_graph_add_pass(choice->graph, &row, error)
        && add_halved_image(choice, pass, &row, error);
}

// What the taps of an upsampling to twice the size are on whole texels: those of a pixel at a
// quarter of a texel after a texel's centre, from the texel before it. The tent's outer taps are up
// to one texel away; a bilinear sample is a tent of no width.
static void find_up_taps(double radius, float taps[4])
{
    static const double shares[3] = {0.25, 0.5, 0.25};
    double sums[4] = {0};

    for (int tap = 0; tap < 3; ++tap) {
        const double at = 1.25 + (tap - 1) * radius, part = at - floor(at);
        const int texel = (int)floor(at);
        sums[texel] += shares[tap] * (1.0 - part);
        if (part > 0.0)
            sums[texel + 1] += shares[tap] * part;
    }
    for (int i = 0; i < 4; ++i)
        taps[i] = (float)sums[i];
}

static bool doubles(const struct vkb_graph *graph, const struct vkb_pass_row *pass, double *radius)
{
    const struct vkb_pyramid_params *params = &pass->params.pyramid;
    const int kernel = pass->constants[2];

    *radius = kernel == UPSAMPLE_TENT ? params->step_x : 0.0;
    return pass->shader == VKB_SHADER_pyramid_up_frag && kernel != UPSAMPLE_CUBIC
        && is_twice(graph, pass->targets[0], pass->reads[0]) && fabs(*radius) <= 1.0
        && (kernel != UPSAMPLE_TENT || params->step_x == params->step_y);
}

bool vkb_add_doubled(const struct vkb_form_choice *choice, const struct vkb_pass_row *pass,
                     bool *fits, struct vkb_error *error)
{
    const struct vkb_graph *plain = &choice->plain;
    struct vkb_pass_row row;
    double radius;

    *fits = doubles(plain, pass, &radius);
    if (!*fits)
        return true;
    memcpy(&row, pass, sizeof row);
    load_in_strips(&row, double_shaders[plain->images[pass->reads[0]].format], DOUBLE_COLUMNS,
                   DOUBLE_ROWS);
    row.constants[0] = pass->constants[1];
    row.constant_count = 1;
    find_up_taps(radius, row.params.pyramid.taps[0]);
    return vkb_graph_add_pass(choice->graph, &row, error);
}

// The composite as it is, and after it one that doubles the last level itself.
bool vkb_add_doubled_final(const struct vkb_form_choice *choice, const struct vkb_pass_row *pass,
                           bool *fits, struct vkb_error *error)
{
    const struct vkb_graph *plain = &choice->plain;
    const struct vkb_pass_row *up = NULL;
    struct vkb_pass_row row;
    struct vkb_double_final_params *params = &row.params.double_final;
    double radius;

    if (pass->shader == VKB_SHADER_composite_frag && pass->constants[0] != COMPOSITE_OFF)
        up = vkb_writer_of(plain, pass->reads[1]);
    *fits = up && doubles(plain, up, &radius) && up->constants[1] == 0
         && plain->images[pass->reads[0]].format == plain->images[pass->reads[1]].format;
    if (!*fits)
        return true;
    memcpy(&row, pass, sizeof row);
    memset(&row.params, 0, sizeof row.params);
    vkb_make_dispatch(&row, double_final_shaders[plain->images[up->reads[0]].format],
                      ROW_INVOCATIONS * DOUBLE_COLUMNS, DOUBLE_ROWS);
    row.loads = true;
    row.alternative = true;
    row.reads[0] = up->reads[0];
    row.reads[1] = pass->reads[0];
    row.constants[4] = vkb_stored_as[plain->images[pass->reads[1]].format];
    row.constant_count = 5;
    row.block = VKB_BLOCK_double_final;
    params->coarse = up->params.pyramid.coarse;
    params->intensity = pass->params.composite.intensity;
    params->exposure = pass->params.composite.exposure;
    params->noise_seed = pass->params.composite.noise_seed;
    params->limit = vkb_formats[plain->images[pass->targets[0]].format].limit;
    find_up_taps(radius, params->taps[0]);
    return vkb_add_fullscreen(choice->forms, choice->graph, pass, error)
        && vkb_graph_add_pass(choice->graph, &row, error);
}
