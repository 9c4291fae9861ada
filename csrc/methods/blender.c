// Blender's Glare node: formulas of the compositor of Blender 5.0 (node_composite_glare.cc). From
// the frame come the highlights, in the size of the quality; from these a glare of the same size,
// by the type; and from this the bloom.
#include "methods/convolve.h"
#include "methods/methods.h"
#include "passes/blur.h"
#include "passes/levels.h"
#include "passes/prefilter.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

// The number of halvings of the glare's share of the shorter side; at least 1.
static uint32_t level_count(const struct vkb_levels *levels)
{
    const struct vkb_size size = levels->sizes[0];
    const uint32_t shorter = size.width < size.height ? size.width : size.height;
    const double count = floor(log2(fmax(shorter * levels->settings->values.size, 1.0)));
    return (uint32_t)fmin(fmax(count, 1.0), MAX_LEVELS);
}

static uint32_t add_bloom(struct vkb_levels *levels)
{
    struct vkb_combination combination = vkb_combine(UPSAMPLE_TENT, 1.0, 1.0);

    levels->count = level_count(levels);
    for (uint32_t level = 1; level < levels->count; ++level)
        levels->sizes[level] = vkb_halved(levels->sizes[level - 1]);
    for (uint32_t level = 1; level < levels->count; ++level) {
        const uint32_t from = levels->downs[level - 1], to = vkb_levels_down(levels, level);
        struct vkb_pass_row row = vkb_describe_prefilter(levels, VKB_PREFILTER_blender, from, to);
        if (level == 1)
            vkb_levels_pass(levels, &row);
        else
            vkb_levels_reduce(levels, 1.0, 1.0, from, to);
    }
    combination.target_step = true;
    return vkb_levels_add_up(levels, &combination);
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

static uint32_t add_streaks(struct vkb_levels *levels)
{
    const struct vkb_values *values = &levels->settings->values;
    const struct vkb_glare_values numbers = {
        .length = 1.0f,
        .base = 4,
        .fade = (float)values->fade,
        .colour_shift = (float)values->color_modulation,
    };
    uint32_t before = VKB_NO_IMAGE, light = VKB_NO_IMAGE;

    for (int i = 0; i < values->streaks; ++i) {
        // Blender reads in the direction of the angle.
        const double angle =
            acos(-1.0) * (1.0 + values->streaks_angle / 180.0 + 2.0 * i / values->streaks);
        float next[MAX_TAPS][4] = {{0.0f}};
        uint32_t from = levels->downs[0];
        for (int iteration = 0; iteration < values->iterations; ++iteration) {
            const bool last = iteration == values->iterations - 1;
            const bool reads_next =
                values->blender_5_2
                && set_next(levels->sizes[0], (float)(angle - acos(-1.0)), iteration, next);
            const double share = last ? 1.0 / (STAR_ITERATIONS + 1 - values->iterations) : 1.0;
            light = vkb_levels_step(levels, levels->sizes[0], "ray_%u",
                                    (uint32_t)(i * values->iterations + iteration));
            const struct vkb_ray ray = {
                .values = &numbers,
                .angle = angle,
                .gain = share * ray_gain(&numbers, iteration),
                .next = reads_next ? next : NULL,
                .iteration = iteration,
                .from = from,
                .before = last ? before : VKB_NO_IMAGE,
                .to = light,
            };
            vkb_add_ray_pass(levels, &ray);
            from = light;
        }
        before = light;
    }
    return light;
}

// The highlights blurred by a Gaussian, whose standard deviation is a third of the radius.
static uint32_t add_blurred(struct vkb_levels *levels, uint32_t radius)
{
    struct vkb_kernel kernel = {.count = radius + 1, .step = 1.0};
    struct vkb_filter filter;
    double sum = -1.0;

    for (uint32_t tap = 0; tap < kernel.count; ++tap) {
        kernel.weights[tap] = exp(-4.5 * tap * tap / ((double)radius * radius));
        sum += 2.0 * kernel.weights[tap];
    }
    const uint32_t down = vkb_levels_step(levels, levels->sizes[0], "ghost_%u_down", radius);
    const uint32_t blurred = vkb_levels_step(levels, levels->sizes[0], "ghost_%u", radius);
    vkb_filter_begin(levels->graph, levels->downs[0], down, &filter);
    filter.gain = 1.0 / sum;
    filter.y.kernel = kernel;
    const struct vkb_pass_row columns =
        vkb_blur_row(levels, &filter, false, levels->downs[0], down);
    vkb_levels_pass(levels, &columns);
    vkb_filter_begin(levels->graph, down, blurred, &filter);
    filter.gain = 1.0 / sum;
    filter.x.kernel = kernel;
    struct vkb_pass_row rows = vkb_blur_row(levels, &filter, false, down, blurred);
    vkb_join(levels, &columns, &rows);
    vkb_levels_pass(levels, &rows);
    return blurred;
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

static uint32_t add_ghosts(struct vkb_levels *levels)
{
    static const float scales[2] = {2.13f, -0.97f};
    const struct vkb_values *values = &levels->settings->values;
    const uint32_t radius = 16u >> levels->settings->choices[VKB_CHOICE_quality];
    struct vkb_stage stage = {
        .kind = VKB_STAGE_GHOSTS,
        .values = {.maximum = FLT_MAX, .radius = 0.5f, .falloff = 1.0f},
        .ghost_count = 1,
        .ghosts = {{1.0f, 1.0f, 1.0f}},
    };
    uint32_t from, light = VKB_NO_IMAGE, before = VKB_NO_IMAGE;

    for (uint32_t i = 0; i < 2; ++i) {
        stage.ghosts[0][3] = scales[i];
        from = add_blurred(levels, radius << i);
        light = vkb_levels_step(levels, levels->sizes[0], "ghosts_of_blur_%u", i);
        vkb_add_flare_pass(levels, &stage, from, before, light);
        before = light;
    }
    before = VKB_NO_IMAGE;
    for (int i = 1; i < values->iterations; ++i) {
        from = light;
        set_ghosts(values, i, &stage);
        light = vkb_levels_step(levels, levels->sizes[0], "ghosts_%u", (uint32_t)i);
        vkb_add_flare_pass(levels, &stage, from, before, light);
        before = light;
    }
    return light;
}

static uint32_t add_convolution(struct vkb_levels *levels)
{
    const struct vkb_image_row result = {.name = "convolved", .format = VKB_FORMAT_RGBA32_FLOAT};
    const struct vkb_bloom_source *source = levels->source;
    struct vkb_bloom_source highlights = *source;

    highlights.glow = levels->downs[0];
    highlights.buffers = levels->sizes[0];
    levels->source = &highlights;
    const uint32_t light = vkb_convolve(levels, &result);
    levels->source = source;
    return light;
}

// The recursive filter along one direction and back, at growing distances. The last pass adds
// `before`, if there is one.
static uint32_t add_line(struct vkb_levels *levels, int direction, int step_x, int step_y,
                         uint32_t before)
{
    const struct vkb_values *values = &levels->settings->values;
    const struct vkb_size size = levels->sizes[0];
    const uint32_t lines = (step_x ? size.height : 0) + (step_y ? size.width : 0);
    const int passes = 2 * (values->iterations - 1);
    uint32_t from = levels->downs[0];

    for (int i = 0; i < passes; ++i) {
        const bool adds = before != VKB_NO_IMAGE && i == passes - 1;
        const uint32_t to = vkb_levels_step(levels, levels->sizes[0], "star_%u",
                                            (uint32_t)(direction * passes + i));
        struct vkb_pass_row row =
            vkb_row_of_lines(levels, &vkb_shader_simple_star_comp, lines, from, to);
        vkb_read_at(&row, SLOT_BEFORE, adds ? before : VKB_NO_IMAGE);
        row.constants.adds_image = adds;
        row.constants.distance = i / 2 + 1;
        row.block = VKB_BLOCK_star;
        row.params.star = (struct vkb_star_params){
            .step_x = step_x,
            .step_y = step_y,
            .backwards = i % 2,
            .fade = (float)values->fade,
        };
        vkb_levels_pass(levels, &row);
        from = to;
    }
    return from;
}

static uint32_t add_simple_star(struct vkb_levels *levels)
{
    const bool diagonal = levels->settings->values.diagonal;
    const uint32_t before = add_line(levels, 0, 1, diagonal ? -1 : 0, VKB_NO_IMAGE);

    return add_line(levels, 1, diagonal ? -1 : 0, -1, before);
}

// Adds the pass that finds where there is no light.
static uint32_t add_dark(struct vkb_levels *levels)
{
    const struct vkb_size blocks = {
        .width = (levels->sizes[0].width + BEAM_BLOCK - 1) / BEAM_BLOCK,
        .height = (levels->sizes[0].height + BEAM_BLOCK - 1) / BEAM_BLOCK,
    };
    // Of single floats, which passes on the host read.
    const uint32_t dark =
        vkb_levels_target(levels, "beams_dark", VKB_FORMAT_RGBA32_FLOAT, blocks, false);
    struct vkb_pass_row row =
        vkb_fetching_row(levels, &vkb_shader_beam_dark_frag, levels->downs[0], dark);

    row.block = VKB_BLOCK_sun_beams;
    vkb_levels_pass(levels, &row);
    return dark;
}

static uint32_t add_sun_beams(struct vkb_levels *levels)
{
    const struct vkb_settings *settings = levels->settings;
    const struct vkb_size size = levels->sizes[0];
    const int most = (int)(settings->values.size * floor(hypot(size.width, size.height)));

    if (most == 0)
        return levels->downs[0];
    const uint32_t light = vkb_levels_step(levels, levels->sizes[0], "beams");
    struct vkb_pass_row row =
        vkb_fetching_row(levels, &vkb_shader_sun_beams_frag, levels->downs[0], light);
    row.constants.jittered = settings->values.jitter > 0.0;
    if (!row.constants.jittered)
        vkb_read_at(&row, SLOT_DARK, add_dark(levels));
    row.block = VKB_BLOCK_sun_beams;
    row.params.sun_beams = (struct vkb_sun_beams_params){
        .most = most,
        .sun_x = settings->sun_position[0],
        .sun_y = 1.0f - settings->sun_position[1],
        .left = 1.0f - (float)settings->values.jitter,
    };
    vkb_levels_pass(levels, &row);
    return light;
}

// Each makes the glare from the highlights, which are the first level.
static uint32_t (*const types[])(struct vkb_levels *) = {
    [TYPE_BLOOM] = add_bloom,
    [TYPE_GHOSTS] = add_ghosts,
    [TYPE_STREAKS] = add_streaks,
    [TYPE_FOG_GLOW] = add_convolution,
    [TYPE_SIMPLE_STAR] = add_simple_star,
    [TYPE_SUN_BEAMS] = add_sun_beams,
    [TYPE_KERNEL] = add_convolution,
};

// The highlights, which in high quality are the framebuffer "glow".
static void add_highlights(struct vkb_levels *levels)
{
    const struct vkb_bloom_source *source = levels->source;
    const uint32_t factor = 1u << levels->settings->choices[VKB_CHOICE_quality];
    const uint32_t glow = vkb_levels_image(levels, source->buffers, "glow");

    levels->sizes[0] = (struct vkb_size){
        .width = (source->buffers.width + factor - 1) / factor,
        .height = (source->buffers.height + factor - 1) / factor,
    };
    levels->count = 1;
    levels->downs[0] =
        factor == 1 ? glow : vkb_levels_image(levels, levels->sizes[0], "highlights");
    struct vkb_pass_row row =
        vkb_describe_prefilter(levels, VKB_PREFILTER_highlights, source->glow, levels->downs[0]);
    row.constants.mean_side = factor > 1 ? (int32_t)factor : 0;
    vkb_levels_masked(levels, &row);
    if (factor > 1)
        vkb_levels_resize(levels, levels->downs[0], 1.0, glow);
}

// The glare, enlarged, saturated and tinted.
static uint32_t add_end(struct vkb_levels *levels, uint32_t light, double gain)
{
    const struct vkb_settings *settings = levels->settings;
    const float *tint = settings->tint;
    const uint32_t bloom = vkb_levels_bloom(levels);
    struct vkb_pass_row row = vkb_fetching_row(levels, &vkb_shader_blender_end_frag, light, bloom);

    row.block = VKB_BLOCK_blender_end;
    row.params.blender_end = (struct vkb_blender_end_params){
        .saturation = settings->values.saturation,
        .rounding = vkb_needs_kernel(settings) ? 1e-6f : 0.0f,
        .factors = {{
            (float)(gain * tint[0]),
            (float)(gain * tint[1]),
            (float)(gain * tint[2]),
            (float)(gain * (tint[0] + tint[1] + tint[2]) / 3.0),
        }},
    };
    VKB_SET_TARGET(&row, blender_end, &levels->graph->images[bloom]);
    if (settings->values.blender_5_2) {
        const struct vkb_size from = levels->sizes[0], to = levels->source->buffers;
        float *next = row.params.blender_end.next[0];
        next[0] = next_bits(from.width, to.width, 0.0f, 0.0);
        next[1] = next_bits(from.height, to.height, 0.0f, 0.0);
        row.params.blender_end.reads_next = next[0] > 0.0f || next[1] > 0.0f;
    }
    vkb_levels_pass(levels, &row);
    return bloom;
}

// The filter of a star keeps as many pixels of a line as its largest distance; of the shares of
// streaks nothing is left beyond.
static bool check_iterations(struct vkb_levels *levels)
{
    const int iterations = levels->settings->values.iterations;
    const int type = levels->settings->choices[VKB_CHOICE_type];

    return (type != TYPE_SIMPLE_STAR && type != TYPE_STREAKS) || iterations <= STAR_ITERATIONS
        || vkb_fail(levels->error, VKB_ERROR_VALUE, "iterations: %d is out of range, 2 to %d",
                    iterations, STAR_ITERATIONS);
}

uint32_t vkb_add_blender_method(struct vkb_levels *levels)
{
    const int type = levels->settings->choices[VKB_CHOICE_type];
    const struct vkb_bloom_source *source = levels->source;
    struct vkb_bloom_source floats = *source;

    levels->failed = levels->failed || !check_iterations(levels);
    if (levels->failed)
        return 0;
    // What spreads over hundreds of pixels is too little for 8 bits and for 6 bits of mantissa.
    if (source->format != VKB_FORMAT_RGBA32_FLOAT)
        floats.format = VKB_FORMAT_RGBA16_FLOAT;
    add_highlights(levels);
    if (type != TYPE_BLOOM)
        levels->source = &floats;
    const uint32_t light = types[type](levels);
    levels->source = source;
    return add_end(levels, light, type == TYPE_BLOOM ? levels->below / levels->count : 1.0);
}
