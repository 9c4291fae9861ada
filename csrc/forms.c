#include "forms.h"

#include "methods.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const form_names[VKB_FORMS_COUNT] = {
    [VKB_FORMS_FRAGMENT] = "fragment",
    [VKB_FORMS_CPU] = "cpu",
    [VKB_FORMS_GPU] = "gpu",
};

enum vkb_forms vkb_forms_by_name(const char *name, const struct vkb_device *device)
{
    int forms = 0;

    if (!device->dispatch)
        return VKB_FORMS_FRAGMENT;
    if (strcmp(name, "auto") == 0)
        return device->adapter.device_type == VK_PHYSICAL_DEVICE_TYPE_CPU ? VKB_FORMS_CPU
                                                                          : VKB_FORMS_GPU;
    while (forms < VKB_FORMS_COUNT && strcmp(form_names[forms], name) != 0)
        ++forms;
    return (enum vkb_forms)forms;
}

static const enum vkb_mode stored_as[VKB_FORMAT_COUNT] = {
    [VKB_FORMAT_RGBA8_UNORM] = STORED_UNORM8,
    [VKB_FORMAT_RGBA16_FLOAT] = STORED_HALF,
    [VKB_FORMAT_RGBA32_FLOAT] = STORED_SINGLE,
};

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

static bool is_written_once(const struct vkb_graph *graph, uint32_t image)
{
    uint32_t writers = 0;

    for (uint32_t i = 0; i < graph->pass_count; ++i)
        for (uint32_t target = 0; target < graph->passes[i].target_count; ++target)
            writers += graph->passes[i].targets[target] == image;
    return writers == 1;
}

// Makes a dispatch of a pass over all pixels.
static void dispatch(struct vkb_pass_row *row, enum vkb_shader shader, uint32_t block_width,
                     uint32_t block_height)
{
    row->geometry = VKB_GEOMETRY_DISPATCH;
    row->vertex = (enum vkb_shader)0;
    row->shader = shader;
    row->block_width = block_width;
    row->block_height = block_height;
}

// The choice of forms for one graph: the passes of `plain` to those of `graph`.
struct choice {
    enum vkb_forms forms;
    const VkPhysicalDeviceLimits *limits;
    struct vkb_graph plain;
    struct vkb_graph *graph;
};

// A form adds what runs for a pass; false in *fits, and nothing added, where it does not suit it.
struct form {
    enum vkb_forms forms;
    bool (*add)(const struct choice *choice, const struct vkb_pass_row *pass, bool *fits,
                struct vkb_error *error);
    uint32_t least_pixels;  // of the target
};

#define BY_FORMAT(shader) \
    { \
        [VKB_FORMAT_RGBA8_UNORM] = VKB_SHADER_##shader##_rgba8unorm, \
        [VKB_FORMAT_RGBA16_FLOAT] = VKB_SHADER_##shader##_rgba16float, \
        [VKB_FORMAT_RGBA32_FLOAT] = VKB_SHADER_##shader##_rgba32float, \
    }

static const enum vkb_shader line_shaders[VKB_FORMAT_COUNT] = BY_FORMAT(line_comp);
static const enum vkb_shader strip_shaders[VKB_FORMAT_COUNT] = BY_FORMAT(strip_comp);
static const enum vkb_shader halve_shaders[VKB_FORMAT_COUNT] = BY_FORMAT(halve_comp);
static const enum vkb_shader double_shaders[VKB_FORMAT_COUNT] = BY_FORMAT(double_comp);
static const enum vkb_shader double_final_shaders[VKB_FORMAT_COUNT] = BY_FORMAT(double_final_comp);
static const enum vkb_shader blend_shaders[VKB_FORMAT_COUNT] = BY_FORMAT(blend_comp);
static const enum vkb_shader bright_shaders[VKB_FORMAT_COUNT] = BY_FORMAT(bright_comp);

// A composite whose images have one size and format.
static bool blends(const struct vkb_graph *graph, const struct vkb_pass_row *pass)
{
    return pass->shader == VKB_SHADER_composite_frag && pass->constants[0] != COMPOSITE_OFF
        && pass->constants[4] == BLOOM_OWN && vkb_same_size(graph, pass->reads[0], pass->targets[0])
        && vkb_same_size(graph, pass->reads[1], pass->targets[0])
        && graph->images[pass->reads[0]].format == graph->images[pass->reads[1]].format;
}

// An extraction in the image's own size.
static bool brightens(const struct vkb_pass_row *pass)
{
    return pass->shader == VKB_SHADER_extract_frag && pass->constants[1] == SAMPLING_WHOLE;
}

// A pass that needs the texels at each pixel's own place alone, by a shader that loads them.
static void load_texels(struct vkb_pass_row *row, enum vkb_shader shader, uint32_t constants)
{
    dispatch(row, shader, 8 * TEXEL_COLUMNS, TEXEL_ROWS);
    row->loads = true;
    memset(&row->constants[constants], 0,
           (VKB_MAX_CONSTANTS - constants) * sizeof row->constants[0]);
    row->constant_count = constants;
}

// A pass over all pixels of one target: on processors drawn, where its texels cannot be loaded, on
// GPUs a compute shader, for some of them (made to compute) draw slowly.
static bool add_fullscreen(enum vkb_forms forms, struct vkb_graph *graph,
                           const struct vkb_pass_row *pass, struct vkb_error *error)
{
    const enum vkb_format format = graph->images[pass->reads[0]].format;
    struct vkb_pass_row row;

    memcpy(&row, pass, sizeof row);
    if (forms == VKB_FORMS_GPU)
        dispatch(&row, vkb_spirv[pass->shader].dispatch, 8, 8);
    else if (blends(graph, pass))
        load_texels(&row, blend_shaders[format], 4);
    else if (brightens(pass))
        load_texels(&row, bright_shaders[format], 1);
    return vkb_graph_add_pass(graph, &row, error);
}

static bool add_loaded(const struct choice *choice, const struct vkb_pass_row *pass, bool *fits,
                       struct vkb_error *error)
{
    *fits = pass->geometry == VKB_GEOMETRY_FULLSCREEN
         && (blends(&choice->plain, pass) || brightens(pass));
    return !*fits || add_fullscreen(choice->forms, choice->graph, pass, error);
}

static bool add_pixels(const struct choice *choice, const struct vkb_pass_row *pass, bool *fits,
                       struct vkb_error *error)
{
    *fits = pass->geometry == VKB_GEOMETRY_FULLSCREEN
         && vkb_spirv[pass->shader].dispatch != pass->shader
         && is_written_once(&choice->plain, pass->targets[0]);
    return !*fits || add_fullscreen(choice->forms, choice->graph, pass, error);
}

// A line's row: `origin` is the place of the target's first pixel in the source.
static struct vkb_pass_row line_row(const struct vkb_graph *graph, const struct vkb_pass_row *blur,
                                    const struct kernel *kernel, uint32_t target, int origin)
{
    const bool vertical = blur->constants[0] == DIRECTION_VERTICAL;
    struct vkb_pass_row row;

    memcpy(&row, blur, sizeof row);
    memset(&row.constants, 0, sizeof row.constants);
    memset(&row.params, 0, sizeof row.params);
    dispatch(&row, line_shaders[graph->images[blur->reads[0]].format],
             vertical ? 8 : 8 * LINE_OUTPUTS, vertical ? LINE_OUTPUTS : 1);
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
static bool add_line(const struct choice *choice, const struct vkb_pass_row *pass, bool *fits,
                     struct vkb_error *error)
{
    struct kernel kernel;

    *fits = is_blur(pass) && vkb_same_size(&choice->plain, pass->reads[0], pass->targets[0])
         && is_written_once(&choice->plain, pass->targets[0])
         && find_kernel(pass, LINE_RADIUS, &kernel);
    if (!*fits)
        return true;
    struct vkb_pass_row row = line_row(choice->graph, pass, &kernel, pass->targets[0], 0);
    return vkb_graph_add_pass(choice->graph, &row, error);
}

// A blur with taps between the texels of a source of the target's size, as one with taps on them:
// fewer texels to fetch, and no filter.
static bool add_whole_taps(const struct choice *choice, const struct vkb_pass_row *pass, bool *fits,
                           struct vkb_error *error)
{
    struct kernel kernel;
    struct vkb_pass_row row;
    struct vkb_blur_params *params = &row.params.blur;

    *fits = is_blur(pass) && vkb_same_size(&choice->plain, pass->reads[0], pass->targets[0])
         && is_written_once(&choice->plain, pass->targets[0])
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
    return add_fullscreen(choice->forms, choice->graph, &row, error);
}

// A horizontal blur into a target of another size, its taps whole texels apart: such a blur
// commutes with the filter between the sizes, so it runs in the source's size, and every pixel of
// the target takes one sample of it instead of one a tap.
static bool add_enlarged(const struct choice *choice, const struct vkb_pass_row *pass, bool *fits,
                         struct vkb_error *error)
{
    const struct vkb_image_row *source = &choice->plain.images[pass->reads[0]];
    const struct vkb_image_row *target = &choice->plain.images[pass->targets[0]];
    const struct vkb_sampling sampling = vkb_sampling_into(&choice->plain, pass->targets[0]);
    struct kernel kernel;
    uint32_t lines;

    *fits = is_blur(pass) && pass->constants[0] == DIRECTION_HORIZONTAL
         && !vkb_same_size(&choice->plain, pass->reads[0], pass->targets[0])
         && is_written_once(&choice->plain, pass->targets[0])
         && floor(tap_step(pass)) == tap_step(pass)
         && source->width + 2 <= choice->limits->maxFramebufferWidth
         && find_kernel(pass, LINE_RADIUS, &kernel);
    if (!*fits)
        return true;
    // In floats: what is between two rounded values must not be rounded before. The border holds
    // what the filter takes from beyond the edges.
    const struct vkb_size size = {source->width + 2, source->height};
    const bool unorm = target->format == VKB_FORMAT_RGBA8_UNORM;
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
        && add_fullscreen(choice->forms, choice->graph, &row, error);
}

// The chain of passes that gives an image its bloom where all have its size.
struct chain {
    const struct vkb_pass_row *extract, *down, *across, *composite;
    struct kernel down_kernel, across_kernel;
};

static const struct vkb_pass_row *writer_of(const struct vkb_graph *graph, uint32_t image)
{
    const struct vkb_pass_row *writer = NULL;

    for (uint32_t i = 0; i < graph->pass_count; ++i)
        if (graph->passes[i].target_count == 1 && graph->passes[i].targets[0] == image)
            writer = &graph->passes[i];
    return writer;
}

// The one blur of that direction that writes the image.
static const struct vkb_pass_row *blur_of(const struct vkb_graph *graph, uint32_t image,
                                          enum vkb_mode direction)
{
    const struct vkb_pass_row *pass = writer_of(graph, image);

    return pass && is_blur(pass) && pass->constants[0] == (int32_t)direction
                && is_written_once(graph, image) && vkb_same_size(graph, pass->reads[0], image)
             ? pass
             : NULL;
}

// The extraction of an image's bright parts in its own size and format that writes `image`, if any.
static const struct vkb_pass_row *extract_of(const struct vkb_graph *graph, uint32_t image)
{
    const struct vkb_pass_row *pass = writer_of(graph, image);

    return pass && pass->shader == VKB_SHADER_extract_frag && pass->constants[1] == SAMPLING_WHOLE
                && graph->images[pass->reads[0]].format == graph->images[image].format
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
        chain->extract = extract_of(graph, chain->down->reads[0]);
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
    row.constants[5] = stored_as[format];
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
static bool add_strips(const struct choice *choice, const struct vkb_pass_row *pass, bool *fits,
                       struct vkb_error *error)
{
    struct chain chain;

    *fits = find_chain(&choice->plain, pass, STRIP_RADIUS, &chain);
    if (!*fits)
        return true;
    struct vkb_pass_row row = whole_row(&choice->plain, &chain);
    dispatch(&row, strip_shaders[choice->plain.images[pass->reads[0]].format], 8 * STRIP_COLUMNS,
             STRIP_ROWS);
    row.loads = true;
    return add_fullscreen(choice->forms, choice->graph, pass, error)
        && vkb_graph_add_pass(choice->graph, &row, error);
}

// The composite as it is, and after it one that takes the bloom from the lines that end in it.
static bool add_from_lines(const struct choice *choice, const struct vkb_pass_row *pass, bool *fits,
                           struct vkb_error *error)
{
    const struct vkb_pass_row *enlarging = NULL;
    struct vkb_pass_row row;

    if (pass->shader == VKB_SHADER_composite_frag && pass->constants[0] != COMPOSITE_OFF)
        enlarging = writer_of(choice->graph, pass->reads[1]);
    *fits = enlarging
         && (enlarging->shader == VKB_SHADER_enlarge_frag
             || enlarging->shader == VKB_SHADER_enlarge_dispatch);
    if (!*fits)
        return true;
    memcpy(&row, pass, sizeof row);
    row.reads[1] = enlarging->reads[0];
    row.constants[4] = BLOOM_LINES;
    row.constants[5] = stored_as[choice->plain.images[pass->reads[1]].format];
    row.constant_count = 6;
    row.alternative = true;
    return add_fullscreen(choice->forms, choice->graph, pass, error)
        && add_fullscreen(choice->forms, choice->graph, &row, error);
}

// The same in tiles, for kernels of up to TILE_RADIUS in three steps.
static bool add_tiles(const struct choice *choice, const struct vkb_pass_row *pass, bool *fits,
                      struct vkb_error *error)
{
    const size_t shared = 3 * sizeof(float) * TILE_ROWS * TILE_LOADED;
    struct chain chain;
    int radius = TILE_RADIUS / 4;

    *fits = choice->limits->maxComputeSharedMemorySize >= shared
         && choice->limits->maxComputeWorkGroupInvocations >= TILE_LOADED * TILE_RUNS
         && find_chain(&choice->plain, pass, TILE_RADIUS, &chain);
    if (!*fits)
        return true;
    while (radius < chain.down_kernel.radius || radius < chain.across_kernel.radius)
        radius *= 2;
    struct vkb_pass_row row = whole_row(&choice->plain, &chain);
    dispatch(&row, VKB_SHADER_tile_comp, (uint32_t)(TILE_LOADED - 2 * radius), TILE_ROWS);
    row.constants[6] = radius;
    row.constant_count = 7;
    return add_fullscreen(choice->forms, choice->graph, pass, error)
        && vkb_graph_add_pass(choice->graph, &row, error);
}

static bool is_twice(const struct vkb_graph *graph, uint32_t large, uint32_t small)
{
    return graph->images[large].width == 2 * graph->images[small].width
        && graph->images[large].height == 2 * graph->images[small].height;
}

static void load_in_strips(struct vkb_pass_row *row, enum vkb_shader shader, uint32_t columns,
                           uint32_t rows)
{
    dispatch(row, shader, 8 * columns, rows);
    row->loads = true;
    memset(row->constants, 0, sizeof row->constants);
    row->constant_count = 0;
}

// Where the larger level is what is extracted of an image: from the image itself, as an alternative
// to `halving`, which `pass` became.
static bool add_halved_image(const struct choice *choice, const struct vkb_pass_row *pass,
                             const struct vkb_pass_row *halving, struct vkb_error *error)
{
    const struct vkb_pass_row *extract = extract_of(&choice->plain, pass->reads[0]);
    struct vkb_pass_row row;

    if (!extract)
        return true;
    memcpy(&row, halving, sizeof row);
    row.reads[0] = extract->reads[0];
    row.alternative = true;
    row.constants[0] = 1;
    row.constants[1] = extract->constants[0];
    row.constants[2] = stored_as[choice->plain.images[pass->reads[0]].format];
    row.constant_count = 3;
    row.params.pyramid.threshold = extract->params.extract.threshold;
    row.params.pyramid.knee = extract->params.extract.knee;
    return vkb_graph_add_pass(choice->graph, &row, error);
}

// The 13 taps from a level of exactly twice the size. Where fireflies are filtered the groups have
// weights of their own, so that the kernel does not fall apart into separable ones.
static bool add_halved(const struct choice *choice, const struct vkb_pass_row *pass, bool *fits,
                       struct vkb_error *error)
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
        && is_twice(graph, pass->targets[0], pass->reads[0]) && *radius <= 1.0
        && (kernel != UPSAMPLE_TENT || params->step_x == params->step_y);
}

static bool add_doubled(const struct choice *choice, const struct vkb_pass_row *pass, bool *fits,
                        struct vkb_error *error)
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
static bool add_doubled_final(const struct choice *choice, const struct vkb_pass_row *pass,
                              bool *fits, struct vkb_error *error)
{
    const struct vkb_graph *plain = &choice->plain;
    const struct vkb_pass_row *up = NULL;
    struct vkb_pass_row row;
    struct vkb_double_final_params *params = &row.params.double_final;
    double radius;

    if (pass->shader == VKB_SHADER_composite_frag && pass->constants[0] != COMPOSITE_OFF)
        up = writer_of(plain, pass->reads[1]);
    *fits = up && doubles(plain, up, &radius) && up->constants[1] == 0
         && plain->images[pass->reads[0]].format == plain->images[pass->reads[1]].format;
    if (!*fits)
        return true;
    memcpy(&row, pass, sizeof row);
    memset(&row.params, 0, sizeof row.params);
    dispatch(&row, double_final_shaders[plain->images[up->reads[0]].format], 8 * DOUBLE_COLUMNS,
             DOUBLE_ROWS);
    row.loads = true;
    row.alternative = true;
    row.reads[0] = up->reads[0];
    row.reads[1] = pass->reads[0];
    row.constants[4] = stored_as[plain->images[pass->reads[1]].format];
    row.constant_count = 5;
    row.block = VKB_BLOCK_double_final;
    params->coarse = up->params.pyramid.coarse;
    params->intensity = pass->params.composite.intensity;
    params->exposure = pass->params.composite.exposure;
    params->noise_seed = pass->params.composite.noise_seed;
    params->limit = vkb_formats[plain->images[pass->targets[0]].format].limit;
    find_up_taps(radius, params->taps[0]);
    return add_fullscreen(choice->forms, choice->graph, pass, error)
        && vkb_graph_add_pass(choice->graph, &row, error);
}

// A GPU has no use for strips in an image of few pixels: each invocation walks down its strip
// alone. On an H200 halving to 512 x 512 takes 29 us in strips and 56 pixel by pixel, to 256 x 256
// 25 and 18; doubling to 1024 x 1024 33 and 45, to 512 x 512 29 and 15.
enum { HALVE_STRIPS = 1 << 17, DOUBLE_STRIPS = 1 << 19 };

static const struct form forms_table[] = {
    {VKB_FORMS_CPU, add_line, 0},
    {VKB_FORMS_CPU, add_enlarged, 0},
    {VKB_FORMS_CPU, add_strips, 0},
    {VKB_FORMS_CPU, add_from_lines, 0},
    {VKB_FORMS_CPU, add_halved, 0},
    {VKB_FORMS_CPU, add_doubled, 0},
    {VKB_FORMS_CPU, add_doubled_final, 0},
    {VKB_FORMS_CPU, add_loaded, 0},
    {VKB_FORMS_GPU, add_whole_taps, 0},
    {VKB_FORMS_GPU, add_enlarged, 0},
    {VKB_FORMS_GPU, add_from_lines, 0},
    {VKB_FORMS_GPU, add_tiles, 0},
    {VKB_FORMS_GPU, add_halved, HALVE_STRIPS},
    {VKB_FORMS_GPU, add_doubled, DOUBLE_STRIPS},
    {VKB_FORMS_GPU, add_doubled_final, DOUBLE_STRIPS},
    {VKB_FORMS_GPU, add_pixels, 0},
};

static bool add_in_its_form(const struct choice *choice, const struct vkb_pass_row *pass,
                            struct vkb_error *error)
{
    const struct vkb_image_row *target = &choice->plain.images[pass->targets[0]];
    const uint64_t pixels = (uint64_t)target->width * target->height;

    for (size_t i = 0; i < sizeof forms_table / sizeof forms_table[0]; ++i) {
        bool fits = false;
        if (forms_table[i].forms != choice->forms || pixels < forms_table[i].least_pixels)
            continue;
        if (!forms_table[i].add(choice, pass, &fits, error))
            return false;
        if (fits)
            return true;
    }
    return vkb_graph_add_pass(choice->graph, pass, error);
}

bool vkb_forms_choose(enum vkb_forms forms, const VkPhysicalDeviceLimits *limits,
                      struct vkb_graph *graph, struct vkb_error *error)
{
    struct choice choice = {
        .forms = forms,
        .limits = limits,
        .plain = *graph,
        .graph = graph,
    };
    bool done = true;

    if (forms == VKB_FORMS_FRAGMENT)
        return true;
    // The images stay, the passes are laid anew.
    graph->passes = NULL;
    graph->pass_count = 0;
    graph->pass_capacity = 0;
    for (uint32_t i = 0; done && i < choice.plain.pass_count; ++i) {
        // Adding an image may move them all.
        choice.plain.images = graph->images;
        done = add_in_its_form(&choice, &choice.plain.passes[i], error);
    }
    vkb_free(choice.plain.passes);
    return done;
}
