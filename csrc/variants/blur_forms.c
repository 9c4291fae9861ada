// Forms of blurs, and of an image's whole bloom by one.
#include "variants/form.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// A kernel on whole texels: the same blur where each pixel of the target lies on a texel.
struct kernel {
    float weights[LINE_RADIUS + 4];  // the half-kernel, then zeros, in whole vec4s
    int radius;
};

static float tap_weight(const struct vkb_pass_row *blur, int tap)
{
    return blur->params.blur.weights[tap / 4][tap % 4];
}

static double tap_step(const struct vkb_pass_row *blur)
{
    const struct vkb_blur_params *params = &blur->params.blur;
    const double step = (double)params->blur_scale * params->layer_scale;
    const bool ratio = blur->constants[0] == DIRECTION_VERTICAL && blur->constants[3] == TEXEL_X;
    return ratio ? step * params->step_ratio : step;
}

// Taps between two texels are shared out to both. False where the kernel is longer than `limit`.
static bool find_kernel(const struct vkb_pass_row *blur, int limit, struct kernel *kernel)
{
    const struct vkb_blur_params *params = &blur->params.blur;
    const int taps = blur->constants[1];
    const double step = tap_step(blur), strength = params->layer_strength;
    const double side = strength * params->blur_strength;
    double weights[LINE_RADIUS + 4] = {0};

    if (ceil(taps * step) > limit)
        return false;
    weights[0] = tap_weight(blur, 0) * strength;
    if (blur->constants[2] == 0)
        weights[0] += 2.0 * side * tap_weight(blur, 0);
    for (int tap = 1; tap <= taps; ++tap) {
        const double at = tap * step, part = at - floor(at);
        const int texel = (int)floor(at);
        // On the centre's texel both sides of the pair come together.
        weights[texel] += (texel == 0 ? 2.0 : 1.0) * (1.0 - part) * side * tap_weight(blur, tap);
        if (part > 0.0)
            weights[texel + 1] += part * side * tap_weight(blur, tap);
    }
    memset(kernel, 0, sizeof *kernel);
    for (int i = 0; i <= limit; ++i) {
        kernel->weights[i] = (float)weights[i];
        if (weights[i] != 0.0)
            kernel->radius = i;
    }
    return true;
}

static const enum vkb_shader line_shaders[VKB_FORMAT_COUNT] = VKB_BY_FORMAT(line_comp);
static const enum vkb_shader strip_shaders[VKB_FORMAT_COUNT] = VKB_BY_FORMAT(strip_comp);

// A line's row: `origin` is the place of the target's first pixel in the source.
static struct vkb_pass_row line_row(const struct vkb_graph *graph, const struct vkb_pass_row *blur,
                                    const struct kernel *kernel, uint32_t target, int origin)
{
    const bool vertical = blur->constants[0] == DIRECTION_VERTICAL;
    struct vkb_pass_row row;

    memcpy(&row, blur, sizeof row);
    memset(&row.constants, 0, sizeof row.constants);
    memset(&row.params, 0, sizeof row.params);
    vkb_make_dispatch(&row, line_shaders[graph->images[blur->reads[0]].format],
                      vertical ? ROW_INVOCATIONS : ROW_INVOCATIONS * LINE_OUTPUTS,
                      vertical ? LINE_OUTPUTS : 1);
    row.loads = true;
    row.targets[0] = target;
    row.constants[0] = blur->constants[0];
    row.constants[1] = kernel->radius <= LINE_SHORT_RADIUS ? kernel->radius : 0;
    row.constant_count = 2;
    row.block = VKB_BLOCK_line;
    row.params.line.radius = kernel->radius;
    row.params.line.origin = origin;
    row.params.line.limit = vkb_formats[graph->images[target].format].limit;
    for (int tap = 0; tap <= 2 * kernel->radius; ++tap)
        row.params.line.kernel[tap / 4][tap % 4] = kernel->weights[abs(tap - kernel->radius)];
    return row;
}

static bool is_blur(const struct vkb_pass_row *pass)
{
    return pass->geometry == VKB_GEOMETRY_FULLSCREEN && pass->shader == VKB_SHADER_blur_frag
        && pass->constants[0] != DIRECTION_BOTH;
}

// A blur whose source has the target's size, as a line.
bool vkb_add_line(const struct vkb_form_choice *choice, const struct vkb_pass_row *pass, bool *fits,
                  struct vkb_error *error)
{
    struct kernel kernel;

    *fits = is_blur(pass) && vkb_same_size(&choice->plain, pass->reads[0], pass->targets[0])
         && vkb_is_written_once(&choice->plain, pass->targets[0])
         && find_kernel(pass, LINE_RADIUS, &kernel);
    if (!*fits)
        return true;
    struct vkb_pass_row row = line_row(choice->graph, pass, &kernel, pass->targets[0], 0);
    return vkb_graph_add_pass(choice->graph, &row, error);
}

// A blur with taps between the texels of a source of the target's size, as one with taps on them:
// fewer texels to fetch, and no filter.
bool vkb_add_whole_taps(const struct vkb_form_choice *choice, const struct vkb_pass_row *pass,
                        bool *fits, struct vkb_error *error)
{
    struct kernel kernel;
    struct vkb_pass_row row;
    struct vkb_blur_params *params = &row.params.blur;

    *fits = is_blur(pass) && vkb_same_size(&choice->plain, pass->reads[0], pass->targets[0])
         && vkb_is_written_once(&choice->plain, pass->targets[0])
         && floor(tap_step(pass)) != tap_step(pass) && find_kernel(pass, LINE_RADIUS, &kernel);
    if (!*fits)
        return true;
    memcpy(&row, pass, sizeof row);
    params->blur_scale = params->layer_scale = params->blur_strength = params->layer_strength =
        1.0f;
    memcpy(params->weights, kernel.weights, sizeof params->weights);
    row.constants[1] = kernel.radius;
    row.constants[2] = 1;
    row.constants[3] = TEXEL_OWN;
    row.constants[4] = SAMPLING_WHOLE;
    return vkb_add_fullscreen(choice->forms, choice->graph, &row, error);
}

// A horizontal blur into a target of another size, its taps whole texels apart: such a blur
// commutes with the filter between the sizes, so it runs in the source's size, and every pixel of
// the target takes one sample of it instead of one a tap.
bool vkb_add_enlarged(const struct vkb_form_choice *choice, const struct vkb_pass_row *pass,
                      bool *fits, struct vkb_error *error)
{
    const struct vkb_image_row *source = &choice->plain.images[pass->reads[0]];
    const struct vkb_image_row *target = &choice->plain.images[pass->targets[0]];
    const struct vkb_sampling sampling = vkb_sampling_into(&choice->plain, pass->targets[0]);
    // In 8 bits the sampler's filter of the lines is good enough, where there is one for floats.
    const bool unorm = target->format == VKB_FORMAT_RGBA8_UNORM;
    const bool filters = vkb_device_supports(choice->device, VKB_FORMAT_RGBA32_FLOAT,
                                             VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT);
    struct kernel kernel;
    uint32_t lines;

    *fits = is_blur(pass) && pass->constants[0] == DIRECTION_HORIZONTAL
         && !vkb_same_size(&choice->plain, pass->reads[0], pass->targets[0])
         && vkb_is_written_once(&choice->plain, pass->targets[0])
         && floor(tap_step(pass)) == tap_step(pass) && source->width + 2 <= choice->device->max_side
         && (filters || !unorm) && find_kernel(pass, LINE_RADIUS, &kernel);
    if (!*fits)
        return true;
    // In floats: what is between two rounded values must not be rounded before. The border holds
    // what the filter takes from beyond the edges.
    const struct vkb_size size = {source->width + 2, source->height};
    char name[VKB_NAME_SIZE];
    snprintf(name, sizeof name, "%.24s_lines", pass->name);
    if (!vkb_add_target(choice->graph, name, VKB_FORMAT_RGBA32_FLOAT, size, false, &lines, error))
        return false;
    struct vkb_pass_row line = line_row(choice->graph, pass, &kernel, lines, -1);
    struct vkb_pass_row row =
        vkb_fullscreen_row(pass->name, VKB_SHADER_enlarge_frag, pass->targets[0]);
    row.constants[0] = unorm ? SAMPLING_FILTER : SAMPLING_FETCH;
    row.constant_count = 1;
    row.reads[0] = lines;
    row.read_count = 1;
    row.block = VKB_BLOCK_extract;
    row.params.extract.target_width = sampling.width;
    row.params.extract.target_height = sampling.height;
    row.params.extract.limit = sampling.limit;
    return vkb_graph_add_pass(choice->graph, &line, error)
        && vkb_add_fullscreen(choice->forms, choice->graph, &row, error);
}

// The chain of passes that gives an image its bloom where all have its size.
struct chain {
    const struct vkb_pass_row *extract, *down, *across, *composite;
    struct kernel down_kernel, across_kernel;
};

// The one blur of that direction that writes the image.
static const struct vkb_pass_row *blur_of(const struct vkb_graph *graph, uint32_t image,
                                          enum vkb_mode direction)
{
    const struct vkb_pass_row *pass = vkb_writer_of(graph, image);

    return pass && is_blur(pass) && pass->constants[0] == (int32_t)direction
                && vkb_is_written_once(graph, image) && vkb_same_size(graph, pass->reads[0], image)
             ? pass
             : NULL;
}

static bool find_chain(const struct vkb_graph *graph, const struct vkb_pass_row *pass, int radius,
                       struct chain *chain)
{
    *chain = (struct chain){.composite = pass};
    if (pass->shader != VKB_SHADER_composite_frag || pass->constants[0] == COMPOSITE_OFF
        || !graph->images[pass->reads[0]].input)
        return false;
    chain->across = blur_of(graph, pass->reads[1], DIRECTION_HORIZONTAL);
    if (chain->across)
        chain->down = blur_of(graph, chain->across->reads[0], DIRECTION_VERTICAL);
    if (chain->down)
        chain->extract = vkb_extract_of(graph, chain->down->reads[0]);
    return chain->extract && chain->extract->reads[0] == pass->reads[0]
        && find_kernel(chain->down, radius, &chain->down_kernel)
        && find_kernel(chain->across, radius, &chain->across_kernel);
}

static struct vkb_pass_row whole_row(const struct vkb_graph *graph, const struct chain *chain)
{
    const enum vkb_format format = graph->images[chain->composite->targets[0]].format;
    struct vkb_pass_row row;
    struct vkb_whole_params *params = &row.params.whole;

    memcpy(&row, chain->composite, sizeof row);
    memset(&row.params, 0, sizeof row.params);
    row.read_count = 1;
    row.reads[1] = 0;
    row.alternative = true;
    row.constants[4] = chain->extract->constants[0];
    row.constants[5] = vkb_stored_as[format];
    row.constant_count = 6;
    row.block = VKB_BLOCK_whole;
    params->threshold = chain->extract->params.extract.threshold;
    params->knee = chain->extract->params.extract.knee;
    params->intensity = chain->composite->params.composite.intensity;
    params->exposure = chain->composite->params.composite.exposure;
    params->noise_seed = chain->composite->params.composite.noise_seed;
    params->limit = vkb_formats[format].limit;
    params->down_radius = chain->down_kernel.radius;
    params->across_radius = chain->across_kernel.radius;
    memcpy(params->down, chain->down_kernel.weights, sizeof params->down);
    memcpy(params->across, chain->across_kernel.weights, sizeof params->across);
    return row;
}

// The composite as it is, and after it the whole bloom in strips as its alternative.
bool vkb_add_strips(const struct vkb_form_choice *choice, const struct vkb_pass_row *pass,
                    bool *fits, struct vkb_error *error)
{
    struct chain chain;

    *fits = find_chain(&choice->plain, pass, STRIP_RADIUS, &chain);
    if (!*fits)
        return true;
    struct vkb_pass_row row = whole_row(&choice->plain, &chain);
    vkb_make_dispatch(&row, strip_shaders[choice->plain.images[pass->reads[0]].format],
                      ROW_INVOCATIONS * STRIP_COLUMNS, STRIP_ROWS);
    row.loads = true;
    return vkb_add_fullscreen(choice->forms, choice->graph, pass, error)
        && vkb_graph_add_pass(choice->graph, &row, error);
}

// The composite as it is, and after it one that takes the bloom from the lines that end in it.
bool vkb_add_from_lines(const struct vkb_form_choice *choice, const struct vkb_pass_row *pass,
                        bool *fits, struct vkb_error *error)
{
    const struct vkb_pass_row *enlarging = NULL;
    struct vkb_pass_row row;

    if (pass->shader == VKB_SHADER_composite_frag && pass->constants[0] != COMPOSITE_OFF)
        enlarging = vkb_writer_of(choice->graph, pass->reads[1]);
    *fits = enlarging
         && (enlarging->shader == VKB_SHADER_enlarge_frag
             || enlarging->shader == VKB_SHADER_enlarge_dispatch);
    if (!*fits)
        return true;
    memcpy(&row, pass, sizeof row);
    row.reads[1] = enlarging->reads[0];
    row.constants[4] = BLOOM_LINES;
    row.constants[5] = vkb_stored_as[choice->plain.images[pass->reads[1]].format];
    row.constant_count = 6;
    row.alternative = true;
    return vkb_add_fullscreen(choice->forms, choice->graph, pass, error)
        && vkb_add_fullscreen(choice->forms, choice->graph, &row, error);
}

// The same in tiles, for kernels of up to TILE_RADIUS in three steps.
bool vkb_add_tiles(const struct vkb_form_choice *choice, const struct vkb_pass_row *pass,
                   bool *fits, struct vkb_error *error)
{
    const size_t shared = 3 * sizeof(float) * TILE_ROWS * TILE_LOADED;
    struct chain chain;
    int radius = TILE_RADIUS / 4;

    *fits = choice->device->limits.maxComputeSharedMemorySize >= shared
         && choice->device->limits.maxComputeWorkGroupInvocations >= TILE_LOADED * TILE_RUNS
         && find_chain(&choice->plain, pass, TILE_RADIUS, &chain);
    if (!*fits)
        return true;
    while (radius < chain.down_kernel.radius || radius < chain.across_kernel.radius)
        radius *= 2;
    struct vkb_pass_row row = whole_row(&choice->plain, &chain);
    vkb_make_dispatch(&row, VKB_SHADER_tile_comp, (uint32_t)(TILE_LOADED - 2 * radius), TILE_ROWS);
    row.constants[6] = radius;
    row.constant_count = 7;
    return vkb_add_fullscreen(choice->forms, choice->graph, pass, error)
        && vkb_graph_add_pass(choice->graph, &row, error);
}
