// The blooms of Unity's two pipelines. Source: Unity-Technologies/Graphics; URP:
// com.unity.render-pipelines.universal, BloomPostProcessPass.cs @ 13e28e026298, Bloom.shader
// @ 00d472fae509; HDRP: com.unity.render-pipelines.high-definition, HDRenderPipeline.PostProcess.cs
// @ 0148835ea9ba, BloomBlur.compute @ 0e4ca4d79b2c.
#include "methods/methods.h"
#include "passes/filter.h"
#include "passes/prefilter.h"

#include <math.h>

// URP's half-kernel: the binomial coefficients of 12 without the outer ones.
static const struct vkb_kernel urp_kernel = {
    .count = 5,
    .step = 2.0,
    .weights = {0.22702703f, 0.19459459f, 0.12162162f, 0.05405405f, 0.01621622f},
};

// HDRP treats frames below this size as small.
enum { HDRP_MIN_WIDTH = 800, HDRP_MIN_HEIGHT = 450 };

// u_k = lerp(d_k, U(u_k+1), s): both pipelines map the scatter to the range 0.05 to 0.95.
static struct vkb_combination scattered(const struct vkb_settings *settings, enum vkb_mode kernel)
{
    const double share = 0.05 + 0.9 * settings->values.scatter;
    return vkb_combine(kernel, 1.0 - share, share);
}

// The number of halvings of the longer side, less `spared`; from 1 to `most`.
static uint32_t level_count(uint32_t width, uint32_t height, double spared, int most)
{
    const double count = floor(log2(fmax(width, height)) - spared);
    return (uint32_t)fmin(fmax(count, 1.0), most);
}

// How URP enlarges levels; its two newer filters the last one alone.
static enum vkb_mode urp_upsample(const struct vkb_levels *levels)
{
    return levels->settings->values.high_quality_filtering ? UPSAMPLE_CUBIC : UPSAMPLE_LINEAR;
}

// The levels below the first one, which is prefiltered, and the bloom from them.
typedef uint32_t add_urp(struct vkb_levels *levels);

static uint32_t add_gaussian(struct vkb_levels *levels)
{
    const struct vkb_combination combination = scattered(levels->settings, urp_upsample(levels));
    const enum vkb_mode kind =
        levels->settings->values.urp_12 ? UPSAMPLE_LINEAR : UPSAMPLE_INSET_LINEAR;

    for (uint32_t level = 1; level < levels->count; ++level)
        vkb_levels_blur(levels, level, levels->downs[level - 1], &urp_kernel, kind);
    return vkb_levels_combine(levels, &combination);
}

// URP 17: the first level, mixed again and again with the mean of four diagonal taps, each time
// further away. With a scatter of nearly 1 it is the mean alone.
static uint32_t add_kawase(struct vkb_levels *levels)
{
    const double scatter = levels->settings->values.scatter;
    const double share = scatter >= 0.999 ? 1.0 : 0.05 + 0.9 * scatter;
    uint32_t from = levels->downs[0];

    for (uint32_t i = 0; i < levels->count; ++i) {
        const double distance = 0.5 + (i > levels->count / 2 ? i - 1 : i);
        const uint32_t to = vkb_levels_image(levels, levels->sizes[0], "kawase_%u", i);
        const struct vkb_kernel kernels[][2] = {
            {vkb_sides(0.0, 0.0, 1.0 - share), vkb_centre()},
            {vkb_sides(distance, 0.5 * share, 0.0), vkb_sides(distance, 0.5, 0.0)},
        };
        const struct vkb_filter filter = vkb_make_filter(levels->graph, from, to, kernels, 2, 1.0);
        vkb_add_filter_pass(levels, &filter, from, to);
        from = to;
    }
    return vkb_levels_enlarge(levels, urp_upsample(levels), from, 1.0);
}

// URP 17: dual Kawase, whose way up begins with the last level and adds no other.
static uint32_t add_dual(struct vkb_levels *levels)
{
    const double offset = 0.3 + levels->settings->values.scatter;

    for (uint32_t level = 1; level < levels->count; ++level)
        vkb_kawase_down(levels, 1.0, levels->downs[level - 1], vkb_levels_down(levels, level));
    return vkb_levels_enlarge(levels, urp_upsample(levels), vkb_kawase_rise(levels, offset), 1.0);
}

static add_urp *const urp_filters[] = {
    [FILTER_GAUSSIAN] = add_gaussian,
    [FILTER_KAWASE] = add_kawase,
    [FILTER_DUAL] = add_dual,
};

// The first level: one sample, in high quality 13 taps half a texel apart. URP 12 takes a texel's
// width for its height.
static void add_urp_first(struct vkb_levels *levels)
{
    const struct vkb_bloom_source *source = levels->source;
    const struct vkb_size frame = source->buffers;
    const double aspect = (double)frame.height / frame.width;
    const double step_y = levels->settings->values.urp_12 ? 0.5 * aspect : 0.5;
    uint32_t from = source->glow;

    if (levels->settings->values.high_quality_filtering) {
        from = vkb_levels_step(levels, levels->sizes[0], "reduced");
        vkb_levels_reduce(levels, 0.5, step_y, source->glow, from);
    }
    struct vkb_pass_row row =
        vkb_describe_prefilter(levels, VKB_PREFILTER_urp, from, vkb_levels_down(levels, 0));
    row.constants.clamped = true;
    vkb_set_tint(&row, levels->settings->tint);
    vkb_levels_masked(levels, &row);
}

uint32_t vkb_add_urp_method(struct vkb_levels *levels)
{
    const struct vkb_settings *settings = levels->settings;
    const struct vkb_size half = vkb_halved(levels->source->buffers);
    const struct vkb_size size = settings->values.quarter ? vkb_halved(half) : half;
    const uint32_t count = level_count(size.width, size.height, 1.0, settings->values.iterations);

    vkb_levels_add_sizes(levels, size, count);
    add_urp_first(levels);
    return urp_filters[settings->choices[VKB_CHOICE_filter]](levels);
}

// scale * W / 2^(k + 1), rounded half to even.
static uint32_t rounded(uint32_t side, double scale, uint32_t level)
{
    const double size = rint(ldexp(side * scale, -(int)level - 1));
    return size < 1.0 ? 1 : (uint32_t)size;
}

static const struct vkb_kernel hdrp_kernel = {.count = 5, .step = 1.0, .weights = {HDRP_NINE}};

static struct vkb_pass_row hdrp_blur_row(struct vkb_levels *levels, enum vkb_mode direction,
                                         bool first, uint32_t from, uint32_t to)
{
    struct vkb_pass_row row = vkb_describe_prefilter(levels, VKB_PREFILTER_hdrp_level, from, to);
    struct vkb_filter filter;
    const struct vkb_image_row *source = &levels->graph->images[from];
    const struct vkb_image_row *target = &levels->graph->images[to];

    row.constants.direction = direction;
    row.constants.first_level = first;
    if (direction == DIRECTION_HORIZONTAL ? source->width == 2 * target->width
                                          : source->height == 2 * target->height)
        row.constants.sampling = SAMPLING_TEXEL;
    vkb_filter_begin(levels->graph, from, to, &filter);
    struct vkb_axis *axis = direction == DIRECTION_HORIZONTAL ? &filter.x : &filter.y;
    axis->kernel = hdrp_kernel;
    axis->border = first ? VKB_BORDER_FIRST_TWO : VKB_BORDER_LAST;
    vkb_set_filters(levels, &row, &filter, 1);
    return row;
}

// A level from the image above it: a horizontal blur at the height of that image, then a vertical
// one.
static void add_hdrp_level(struct vkb_levels *levels, uint32_t level, uint32_t from)
{
    const struct vkb_size size = levels->sizes[level];
    const struct vkb_size middle = {size.width, levels->graph->images[from].height};
    const uint32_t step = vkb_levels_step(levels, middle, "down_%u_across", level);

    const struct vkb_pass_row rows =
        hdrp_blur_row(levels, DIRECTION_HORIZONTAL, level == 0, from, step);
    vkb_levels_pass(levels, &rows);
    struct vkb_pass_row columns =
        hdrp_blur_row(levels, DIRECTION_VERTICAL, level == 0, step, vkb_levels_down(levels, level));
    vkb_join(levels, &rows, &columns);
    vkb_levels_pass(levels, &columns);
}

uint32_t vkb_add_hdrp_method(struct vkb_levels *levels)
{
    const struct vkb_settings *settings = levels->settings;
    const struct vkb_size frame = levels->source->buffers;
    // In small frames the bicubic filter is too wide for the last levels.
    const bool cubic = settings->values.high_quality_filtering && frame.width >= HDRP_MIN_WIDTH
                    && frame.height >= HDRP_MIN_HEIGHT;
    struct vkb_combination combination =
        scattered(settings, cubic ? UPSAMPLE_INSET_CUBIC : UPSAMPLE_INSET_LINEAR);
    const uint32_t count = level_count(frame.width, frame.height, 2.0, MAX_LEVELS);
    // Levels of smaller width stretch the bloom along x, levels of smaller height along y.
    const double anamorphism = 0.5 * settings->values.anamorphism;
    const double across = 1.0 + fmin(anamorphism, 0.0), down = 1.0 - fmax(anamorphism, 0.0);

    for (uint32_t level = 0; level < count; ++level)
        levels->sizes[level] = (struct vkb_size){rounded(frame.width, across, level),
                                                 rounded(frame.height, down, level)};
    levels->count = count;
    uint32_t from = vkb_levels_step(levels, levels->sizes[0], "reduced");
    struct vkb_pass_row row =
        vkb_describe_prefilter(levels, VKB_PREFILTER_hdrp, levels->source->glow, from);
    vkb_levels_masked(levels, &row);
    for (uint32_t level = 0; level < count; ++level) {
        add_hdrp_level(levels, level, from);
        from = levels->downs[level];
    }
    combination.last_kernel = UPSAMPLE_CUBIC;
    return vkb_levels_combine(levels, &combination);
}
