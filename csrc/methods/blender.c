// Blender's Glare node: formulas of the compositor of Blender 5.0 (node_composite_glare.cc). From
// the frame come the highlights, in the size of the quality; from these a glare of the same size,
// by the type; and from this the bloom.
#include "methods/methods.h"
#include "passes/blur.h"
#include "passes/levels.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

// What the types make the glare from. `levels` has the highlights as its first level.
struct glare {
    const struct vkb_settings *settings;
    struct vkb_levels levels;
    double gain;  // of the result
};

typedef bool add_type(struct glare *glare, uint32_t *light, struct vkb_error *error);

static bool add_step(const struct glare *glare, const char *name, uint32_t number, uint32_t *image,
                     struct vkb_error *error)
{
    return vkb_levels_step(&glare->levels, name, number, glare->levels.sizes[0], image, error);
}

// The number of halvings of the glare's share of the shorter side; at least 1.
static uint32_t level_count(const struct glare *glare)
{
    const struct vkb_size size = glare->levels.sizes[0];
    const uint32_t shorter = size.width < size.height ? size.width : size.height;
    const double count = floor(log2(fmax(shorter * glare->settings->values.size, 1.0)));
    return (uint32_t)fmin(fmax(count, 1.0), MAX_LEVELS);
}

static bool add_bloom(struct glare *glare, uint32_t *light, struct vkb_error *error)
{
    struct vkb_levels *levels = &glare->levels;
    struct vkb_combination combination = vkb_combine(UPSAMPLE_TENT, 1.0, 1.0);
    double below;

    levels->count = level_count(glare);
    for (uint32_t level = 1; level < levels->count; ++level) {
        const uint32_t from = levels->downs[level - 1];
        uint32_t *to = &levels->downs[level];
        levels->sizes[level] = vkb_halved(levels->sizes[level - 1]);
        if (!vkb_levels_image(levels, "down_%u", level, levels->sizes[level], to, error))
            return false;
        struct vkb_pass_row row = vkb_groups_row(levels, GROUPS_BLENDER, from, *to);
        if (level == 1 ? !vkb_graph_add_pass(levels->graph, &row, error)
                       : !vkb_levels_reduce(levels, 1.0, 1.0, from, *to, error))
            return false;
    }
    combination.target_step = true;
    if (!vkb_levels_add_up(levels, &combination, light, &below, error))
        return false;
    glare->gain = below / levels->count;
    return true;
}

// The sum of the weights that Blender gives the taps of an iteration.
static double ray_gain(const struct vkb_glare_values *values, int iteration)
{
    double sum = 0.0;

    for (int tap = 0; tap < values->base; ++tap)
        sum += pow(values->fade, tap * pow(values->base, iteration));
    return sum / 2.0;
}

// The bits of next_texel(): at the texels 0 and 2^k, whether Blender 5.2 reads the one after it
// there. It finds both texels of a pixel by themselves, at u and at u + 1 in single floats. Where u
// is just below such a texel by rounding only, u + 1 is rounded to the integer after the next one.
// Pixels of `count` read `size` texels `offset` texels away, which is `share` of the side.
static float next_bits(uint32_t size, uint32_t count, float share, double offset)
{
    uint32_t bits = 0;

    for (uint32_t bit = 0; bit == 0 || 1u << (bit - 1) < size; ++bit) {
        const uint32_t texel = bit ? 1u << (bit - 1) : 0;
        const double pixel = floor((texel + 0.5 - offset) * count / size);
        const float at = ((float)pixel + 0.5f) / (float)count + share;
        const float scaled = at * (float)size;
        const float place = scaled - 0.5f;
        if (pixel >= 0.0 && pixel < count && floorf(place + 1.0f) > floorf(place) + 1.0f)
            bits |= 1u << bit;
    }
    return (float)bits;
}

// Sets the bits of all taps of an iteration of a ray along `angle`, and returns whether there are
// any.
static bool set_next(struct vkb_size size, float angle, int iteration, float next[MAX_TAPS][4])
{
    const float step = (float)pow(4.0, iteration);
    bool found = false;

    for (int tap = 0; tap < 4; ++tap) {
        const float x = (float)cos(angle) * step / (float)size.width * (float)tap;
        const float y = (float)sin(angle) * step / (float)size.height * (float)tap;
        next[tap][0] = next_bits(size.width, size.width, x, tap * step * cos(angle));
        next[tap][1] = next_bits(size.height, size.height, y, tap * step * sin(angle));
        found = found || next[tap][0] > 0.0f || next[tap][1] > 0.0f;
    }
    return found;
}

static bool add_streaks(struct glare *glare, uint32_t *light, struct vkb_error *error)
{
    const struct vkb_values *values = &glare->settings->values;
    const struct vkb_glare_values numbers = {
        .length = 1.0f,
        .base = 4,
        .fade = (float)values->fade,
        .colour_shift = (float)values->color_modulation,
    };
    uint32_t before = VKB_NO_IMAGE;

    for (int i = 0; i < values->streaks; ++i, before = *light) {
        // Blender reads in the direction of the angle.
        const double angle =
            acos(-1.0) * (1.0 + values->streaks_angle / 180.0 + 2.0 * i / values->streaks);
        float next[MAX_TAPS][4] = {{0.0f}};
        uint32_t from = glare->levels.downs[0];
        for (int iteration = 0; iteration < values->iterations; ++iteration, from = *light) {
            const bool last = iteration == values->iterations - 1;
            const bool reads_next =
                values->blender_5_2
                && set_next(glare->levels.sizes[0], (float)(angle - acos(-1.0)), iteration, next);
            const double share = last ? 1.0 / (6 - values->iterations) : 1.0;
            struct vkb_ray ray = {
                .values = &numbers,
                .angle = angle,
                .gain = share * ray_gain(&numbers, iteration),
                .next = reads_next ? next : NULL,
                .iteration = iteration,
                .from = from,
                .before = last ? before : VKB_NO_IMAGE,
            };
            if (!add_step(glare, "ray_%u", (uint32_t)(i * values->iterations + iteration), light,
                          error))
                return false;
            ray.to = *light;
            if (!vkb_add_ray(&glare->levels, &ray, error))
                return false;
        }
    }
    return true;
}

// The highlights blurred by a Gaussian, whose standard deviation is a third of the radius.
static bool add_blurred(const struct glare *glare, uint32_t radius, uint32_t *image,
                        struct vkb_error *error)
{
    struct vkb_blur blur = {
        .direction = DIRECTION_VERTICAL,
        .count = radius + 1,
        .step_x = 1.0,
        .step_y = 1.0,
    };
    double sum = -1.0;
    uint32_t down;

    for (uint32_t tap = 0; tap < blur.count; ++tap) {
        blur.weights[tap] = exp(-4.5 * tap * tap / ((double)radius * radius));
        sum += 2.0 * blur.weights[tap];
    }
    blur.gain = 1.0 / sum;
    if (!add_step(glare, "ghost_%u_down", radius, &down, error)
        || !add_step(glare, "ghost_%u", radius, image, error))
        return false;
    const struct vkb_graph *graph = glare->levels.graph;
    struct vkb_pass_row row =
        vkb_blur_row(graph, graph->images[down].name, &blur, glare->levels.downs[0], down);
    if (!vkb_graph_add_pass(glare->levels.graph, &row, error))
        return false;
    blur.direction = DIRECTION_HORIZONTAL;
    row = vkb_blur_row(graph, graph->images[*image].name, &blur, down, *image);
    return vkb_graph_add_pass(glare->levels.graph, &row, error);
}

// Sets the four ghosts of an iteration.
static void set_ghosts(const struct vkb_values *values, int iteration, struct vkb_stage *stage)
{
    const double offset = values->iterations % 2 ? 0.5 : 0.0;
    const double kept = 1.0 - values->color_modulation;

    stage->ghost_count = 4;
    for (int ghost = 0; ghost < 4; ++ghost) {
        const double place = (4 * iteration + ghost + offset) / (4 * values->iterations);
        const double scale = 2.1 * (1.0 - place);
        const int whole = (4 - ghost % 4) % 3;  // red, then blue, then green
        for (int channel = 0; channel < 3; ++channel)
            stage->ghosts[ghost][channel] =
                (float)(0.25 * (ghost == 0 || channel == whole ? 1.0 : kept));
        stage->ghosts[ghost][3] = (float)(ghost % 2 ? -0.99 / scale : scale);
    }
}

static bool add_ghosts(struct glare *glare, uint32_t *light, struct vkb_error *error)
{
    static const float scales[2] = {2.13f, -0.97f};
    const struct vkb_values *values = &glare->settings->values;
    const uint32_t radius = 16u >> glare->settings->choices[VKB_CHOICE_quality];
    struct vkb_stage stage = {
        .kind = VKB_STAGE_GHOSTS,
        .values = {.maximum = FLT_MAX, .radius = 0.5f, .falloff = 1.0f},
        .ghost_count = 1,
        .ghosts = {{1.0f, 1.0f, 1.0f}},
    };
    uint32_t from, before = VKB_NO_IMAGE;

    for (uint32_t i = 0; i < 2; ++i, before = *light) {
        stage.ghosts[0][3] = scales[i];
        if (!add_blurred(glare, radius << i, &from, error)
            || !add_step(glare, "ghosts_of_blur_%u", i, light, error)
            || !vkb_add_flare(&glare->levels, &stage, from, before, *light, error))
            return false;
    }
    before = VKB_NO_IMAGE;
    for (int i = 1; i < values->iterations; ++i, before = *light) {
        from = *light;
        set_ghosts(values, i, &stage);
        if (!add_step(glare, "ghosts_%u", (uint32_t)i, light, error)
            || !vkb_add_flare(&glare->levels, &stage, from, before, *light, error))
            return false;
    }
    return true;
}

static bool add_convolution(struct glare *glare, uint32_t *light, struct vkb_error *error)
{
    const struct vkb_image_row result = {.name = "convolved", .format = VKB_FORMAT_RGBA32_FLOAT};
    struct vkb_bloom_source source = *glare->levels.source;

    source.glow = glare->levels.downs[0];
    source.buffers = glare->levels.sizes[0];
    return vkb_convolve(glare->settings, &source, &result, "", glare->levels.graph, light, error);
}

// The recursive filter along one direction and back, at growing distances. The last pass adds
// `before`, if there is one.
static bool add_line(const struct glare *glare, int direction, int step_x, int step_y,
                     uint32_t before, uint32_t *light, struct vkb_error *error)
{
    const struct vkb_values *values = &glare->settings->values;
    const struct vkb_size size = glare->levels.sizes[0];
    const uint32_t lines = (step_x ? size.height : 0) + (step_y ? size.width : 0);
    const int passes = 2 * (values->iterations - 1);
    uint32_t from = glare->levels.downs[0];

    for (int i = 0; i < passes; ++i, from = *light) {
        const bool adds = before != VKB_NO_IMAGE && i == passes - 1;
        if (!add_step(glare, "star_%u", (uint32_t)(direction * passes + i), light, error))
            return false;
        struct vkb_pass_row row =
            vkb_row_of_lines(&glare->levels, &vkb_shader_simple_star_comp, lines, from, *light);
        row.reads[1] = adds ? before : from;
        row.read_count = 2;
        row.constants.add_own = adds;
        row.block = VKB_BLOCK_star;
        row.params.star = (struct vkb_star_params){
            .step_x = step_x,
            .step_y = step_y,
            .backwards = i % 2,
            .distance = i / 2 + 1,
            .fade = (float)values->fade,
            .limit = vkb_formats[glare->levels.source->format].limit,
        };
        if (!vkb_graph_add_pass(glare->levels.graph, &row, error))
            return false;
    }
    return true;
}

static bool add_simple_star(struct glare *glare, uint32_t *light, struct vkb_error *error)
{
    const bool diagonal = glare->settings->values.diagonal;
    uint32_t before;

    return add_line(glare, 0, 1, diagonal ? -1 : 0, VKB_NO_IMAGE, &before, error)
        && add_line(glare, 1, diagonal ? -1 : 0, -1, before, light, error);
}

static bool add_sun_beams(struct glare *glare, uint32_t *light, struct vkb_error *error)
{
    const struct vkb_settings *settings = glare->settings;
    const struct vkb_size size = glare->levels.sizes[0];
    const int most = (int)(settings->values.size * floor(hypot(size.width, size.height)));

    *light = glare->levels.downs[0];
    if (most == 0)
        return true;
    if (!add_step(glare, "beams", 0, light, error))
        return false;
    struct vkb_pass_row row = vkb_fetching_row(&glare->levels, &vkb_shader_sun_beams_frag,
                                               glare->levels.downs[0], *light);
    row.block = VKB_BLOCK_sun_beams;
    row.params.sun_beams = (struct vkb_sun_beams_params){
        .most = most,
        .sun_x = settings->sun_position[0],
        .sun_y = 1.0f - settings->sun_position[1],
        .left = 1.0f - (float)settings->values.jitter,
        .limit = vkb_formats[glare->levels.source->format].limit,
    };
    return vkb_graph_add_pass(glare->levels.graph, &row, error);
}

static add_type *const types[] = {
    [TYPE_BLOOM] = add_bloom,
    [TYPE_GHOSTS] = add_ghosts,
    [TYPE_STREAKS] = add_streaks,
    [TYPE_FOG_GLOW] = add_convolution,
    [TYPE_SIMPLE_STAR] = add_simple_star,
    [TYPE_SUN_BEAMS] = add_sun_beams,
    [TYPE_KERNEL] = add_convolution,
};

// The highlights, which in high quality are the framebuffer "glow".
static bool add_highlights(struct glare *glare, struct vkb_error *error)
{
    struct vkb_levels *levels = &glare->levels;
    const struct vkb_bloom_source *source = levels->source;
    const uint32_t factor = 1u << glare->settings->choices[VKB_CHOICE_quality];
    uint32_t glow;

    levels->sizes[0] = (struct vkb_size){
        .width = (source->buffers.width + factor - 1) / factor,
        .height = (source->buffers.height + factor - 1) / factor,
    };
    levels->count = 1;
    if (!vkb_levels_image(levels, "glow", 0, source->buffers, &glow, error)
        || (factor > 1
            && !vkb_levels_image(levels, "highlights", 0, levels->sizes[0], &levels->downs[0],
                                 error)))
        return false;
    if (factor == 1)
        levels->downs[0] = glow;
    struct vkb_pass_row row =
        vkb_groups_row(levels, GROUPS_HIGHLIGHTS, source->glow, levels->downs[0]);
    if (factor > 1) {
        row.constants.radius = (int32_t)factor;
    }
    vkb_mask_prefilter(levels, &row);
    return vkb_graph_add_pass(levels->graph, &row, error)
        && (factor == 1 || vkb_levels_resize(levels, levels->downs[0], 1.0, glow, error));
}

// The glare, enlarged, saturated and tinted.
static bool add_end(const struct glare *glare, uint32_t light, uint32_t *bloom,
                    struct vkb_error *error)
{
    const float *tint = glare->settings->tint;

    if (!vkb_levels_bloom(&glare->levels, bloom, error))
        return false;
    struct vkb_pass_row row =
        vkb_fetching_row(&glare->levels, &vkb_shader_blender_end_frag, light, *bloom);
    const int type = glare->settings->choices[VKB_CHOICE_type];
    const bool convolved = type == TYPE_FOG_GLOW || type == TYPE_KERNEL;
    row.block = VKB_BLOCK_blender_end;
    row.params.blender_end = (struct vkb_blender_end_params){
        .saturation = glare->settings->values.saturation,
        // Transforms round each channel differently (reference/blender.py).
        .rounding = convolved ? 1e-6f : 0.0f,
        .factors = {{
            (float)(glare->gain * tint[0]),
            (float)(glare->gain * tint[1]),
            (float)(glare->gain * tint[2]),
            (float)(glare->gain * (tint[0] + tint[1] + tint[2]) / 3.0),
        }},
    };
    VKB_SET_TARGET(&row, blender_end, &glare->levels.graph->images[*bloom]);
    if (glare->settings->values.blender_5_2) {
        const struct vkb_size from = glare->levels.sizes[0], to = glare->levels.source->buffers;
        float *next = row.params.blender_end.next[0];
        next[0] = next_bits(from.width, to.width, 0.0f, 0.0);
        next[1] = next_bits(from.height, to.height, 0.0f, 0.0);
        row.no_transpose = next[0] > 0.0f || next[1] > 0.0f;
        row.params.blender_end.reads_next = row.no_transpose;
    }
    return vkb_graph_add_pass(glare->levels.graph, &row, error);
}

bool vkb_add_blender(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                     struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    const int type = settings->choices[VKB_CHOICE_type];
    struct vkb_bloom_source floats = *source;
    struct glare glare = {
        .settings = settings,
        .levels = {.settings = settings, .source = source, .graph = graph},
        .gain = 1.0,
    };
    uint32_t light;

    // What spreads over hundreds of pixels is too little for 8 bits and for 6 bits of mantissa.
    if (source->format != VKB_FORMAT_RGBA32_FLOAT)
        floats.format = VKB_FORMAT_RGBA16_FLOAT;
    if (!add_highlights(&glare, error))
        return false;
    if (type != TYPE_BLOOM)
        glare.levels.source = &floats;
    if (!types[type](&glare, &light, error))
        return false;
    glare.levels.source = source;
    return add_end(&glare, light, bloom, error);
}
