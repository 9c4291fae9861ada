// Unreal Engine's standard bloom, by its documentation: the sum of Gaussians of the frame, each cut
// off at three standard deviations. Small Gaussians are blurs of the frame. Larger ones are blurs
// of levels, as in the engine: each level is half of the one before, and the sums of the levels are
// enlarged and added on the way back.
//
// A Gaussian of a level is the given one to 6e-5 of the bloom's largest value, but for its cut,
// which a level blurs: of one lit pixel the error is up to 1.4e-4. So a Gaussian whose cut counts
// stays at the frame's size. Where it is too long for that, all Gaussians are one Fourier transform
// with their sum (methods/convolution.c).
//
// Beyond the frame are its outermost pixels, without an end. A level has MARGIN texels around the
// frame, of which the outer ones see nothing but these, so that clamping a level's texels is exact.
#include "methods/unreal.h"

#include "methods/methods.h"
#include "passes/blur.h"
#include "passes/filter.h"
#include "passes/prefilter.h"

#include <math.h>
#include <string.h>

// (An enlargement reads two texels beyond half of the margin of the larger level.)
enum { MARGIN = 4 };

// Deviations in texels of a level are from MIN_DEVIATION to twice that.
static const double MIN_DEVIATION = 4.0;
// The greatest deviation of a blur, by the longest kernel.
static const double MAX_DEVIATION = (MAX_WEIGHTS - 6) / 3.0;
// The greatest height of a cut as a share of the kernel's largest value: a level leaves a third of
// it as an error. That of the second of the default Gaussians is 3.3e-4 to 3.8e-4, by the width of
// the frame.
static const double MAX_CUT = 4.5e-4;

struct gaussian {
    double deviations[2];  // along x and y, in pixels of the bloom buffers
    double tint;
    uint32_t level;
};

struct gaussians {
    struct gaussian all[MAX_GAUSSIANS];
    uint32_t count, levels;  // levels after the frame's size
};

static double radius_of(double deviation)
{
    return ceil(3.0 * deviation);
}

// A Gaussian at a distance, of which 1 is the value in the middle.
static double bell(double distance, double deviation)
{
    return distance == 0.0 ? 1.0 : exp(-0.5 * pow(distance / deviation, 2.0));
}

// The sum of a Gaussian with the value 1 in the middle: of long ones by the integral.
static double sum_of(double deviation)
{
    double sum = 1.0;

    if (deviation > 2.0 * MIN_DEVIATION)
        return deviation * sqrt(2.0 * acos(-1.0)) * erf(3.0 / sqrt(2.0));
    for (double i = 1.0; i <= radius_of(deviation); ++i)
        sum += 2.0 * bell(i, deviation);
    return sum;
}

static double peak_of(const struct gaussian *gaussian)
{
    return gaussian->tint / (sum_of(gaussian->deviations[0]) * sum_of(gaussian->deviations[1]));
}

static double cut_of(const struct gaussian *gaussian)
{
    const double *deviations = gaussian->deviations;

    return fabs(peak_of(gaussian))
         * fmax(bell(radius_of(deviations[0]), deviations[0]),
                bell(radius_of(deviations[1]), deviations[1]));
}

// Sets the level of a Gaussian. False: none has a kernel for it.
static bool choose_level(struct gaussian *gaussian, double peak)
{
    const double shorter = fmin(gaussian->deviations[0], gaussian->deviations[1]);
    const double longer = fmax(gaussian->deviations[0], gaussian->deviations[1]);
    const double level = shorter < 2.0 * MIN_DEVIATION || cut_of(gaussian) > MAX_CUT * fabs(peak)
                           ? 0.0
                           : floor(log2(shorter / MIN_DEVIATION));

    // Written so that a number that is none has no level.
    if (!(level < MAX_LEVELS && ldexp(longer, -(int)level) <= MAX_DEVIATION))
        return false;
    gaussian->level = (uint32_t)level;
    return true;
}

// The Gaussians that have a tint. False: they are no blurs.
static bool find_gaussians(const struct vkb_settings *settings, struct vkb_size frame,
                           struct vkb_size buffers, struct gaussians *gaussians)
{
    const double scale = settings->values.size_scale * frame.width / 600.0;
    double peak = 0.0;

    *gaussians = (struct gaussians){0};
    for (int i = 0; i < MAX_GAUSSIANS; ++i) {
        const double size = settings->gaussian_sizes[i], tint = settings->gaussian_tints[i];
        if (tint == 0.0)
            continue;
        struct gaussian *gaussian = &gaussians->all[gaussians->count++];
        *gaussian = (struct gaussian){
            .deviations = {size * (scale * buffers.width / frame.width),
                           size * (scale * buffers.height / frame.height)},
            .tint = tint,
        };
        if (!(gaussian->deviations[0] >= 0.0 && gaussian->deviations[1] >= 0.0))
            return false;
        peak += peak_of(gaussian);
    }
    for (uint32_t i = 0; i < gaussians->count; ++i) {
        if (!choose_level(&gaussians->all[i], peak))
            return false;
        if (gaussians->all[i].level > gaussians->levels)
            gaussians->levels = gaussians->all[i].level;
    }
    return gaussians->count > 0;
}

bool vkb_has_gaussian_levels(const struct vkb_settings *settings, struct vkb_size frame,
                             struct vkb_size buffers)
{
    struct gaussians gaussians;

    return vkb_method_of(settings)->sums_gaussians
        && find_gaussians(settings, frame, buffers, &gaussians);
}

// Sets `to` to the second difference of a symmetric half-kernel.
static void subtract_twice(const double *of, double *to, uint32_t count)
{
    for (uint32_t i = 0; i < count; ++i) {
        const double after = i + 1 < count ? of[i + 1] : 0.0;
        to[i] = of[i ? i - 1 : 1] - 2.0 * of[i] + after;
    }
}

// Divides a half-kernel of a level by what the reductions to it and the enlargements from it
// multiply its spectrum by: exp(-variance w^2 / 2). Their variances are 1/4 and 4/9 texels, less
// what is not there of an endless chain. The second difference stands for -w^2. That of w^6 is for
// the cut alone.
static void sharpen(struct vkb_kernel *kernel, double texel)
{
    const double variance = (1.0 / 4.0 + 4.0 / 9.0) * (1.0 - 1.0 / (texel * texel));
    const double shares[] = {-0.5 * variance, variance / 24.0 + 0.125 * variance * variance, -0.04};
    double differences[4][MAX_WEIGHTS];

    kernel->count += 3;
    memcpy(differences[0], kernel->weights, sizeof kernel->weights);
    for (int i = 0; i < 3; ++i) {
        subtract_twice(differences[i], differences[i + 1], kernel->count);
        for (uint32_t j = 0; j < kernel->count; ++j)
            kernel->weights[j] += shares[i] * differences[i + 1][j];
    }
}

// The half-kernel of a Gaussian of a level. That of the frame's size ends behind the pixel at the
// radius. That of others ends within 1.5 texels, 0.05 texels farther out, and by a term of w^6, by
// which the largest error that the cut leaves is the least one, as found by trial.
static struct vkb_kernel level_kernel(double deviation, uint32_t level)
{
    const double texel = ldexp(1.0, (int)level), width = level ? 1.5 : 1.0;
    const double end = (radius_of(deviation) + 0.5) / texel + (level ? 0.05 : 0.0);
    struct vkb_kernel kernel = {.step = 1.0};
    double sum = 0.0, within;

    while ((within = fmin((end - kernel.count) / width + 0.5, 1.0)) > 1e-9) {
        const double weight = within * bell(kernel.count * texel, deviation);
        sum += (kernel.count ? 2.0 : 1.0) * weight;
        kernel.weights[kernel.count++] = weight;
    }
    for (uint32_t i = 0; i < kernel.count; ++i)
        kernel.weights[i] /= sum;
    if (level)
        sharpen(&kernel, texel);
    return kernel;
}

static void align(struct vkb_filter *filter, double step, int32_t first)
{
    vkb_axis_align(&filter->x, step, first);
    vkb_axis_align(&filter->y, step, first);
}

// Adds the levels, each half of the one before with (1 3 3 1) / 8 along both axes.
static void add_levels(struct vkb_levels *levels, uint32_t count)
{
    const struct vkb_kernel half = vkb_sides(0.75, 0.5, 0.0);
    const struct vkb_kernel kernels[][2] = {{half, half}};
    struct vkb_size inner = levels->source->buffers;

    levels->sizes[0] = inner;
    levels->downs[0] = levels->source->glow;
    levels->count = count + 1;
    for (uint32_t level = 1; level <= count; ++level) {
        inner = vkb_halved_up(inner);
        levels->sizes[level] =
            (struct vkb_size){inner.width + 2 * MARGIN, inner.height + 2 * MARGIN};
        const uint32_t from = levels->downs[level - 1];
        const uint32_t to = vkb_levels_step(levels, levels->sizes[level], "level_%u", level);
        struct vkb_filter filter = vkb_make_filter(levels->graph, from, to, kernels, 1, 1.0);
        align(&filter, 2.0, level == 1 ? -2 * MARGIN : -MARGIN);
        vkb_add_filter_pass(levels, &filter, from, to);
        levels->downs[level] = to;
    }
}

// Adds a Gaussian of its level times its tint.
static void add_gaussian(struct vkb_levels *levels, const struct gaussian *gaussian,
                         uint32_t number, uint32_t to)
{
    const uint32_t from = levels->downs[gaussian->level];
    const uint32_t between =
        vkb_levels_step(levels, levels->sizes[gaussian->level], "gaussian_%u_down", number);
    struct vkb_filter columns, rows;

    vkb_filter_begin(levels->graph, from, between, &columns);
    columns.y.kernel = level_kernel(gaussian->deviations[1], gaussian->level);
    const struct vkb_pass_row first = vkb_blur_row(levels, &columns, false, from, between);
    vkb_levels_pass(levels, &first);
    vkb_filter_begin(levels->graph, between, to, &rows);
    rows.x.kernel = level_kernel(gaussian->deviations[0], gaussian->level);
    rows.gain = gaussian->tint;
    struct vkb_pass_row second = vkb_blur_row(levels, &rows, false, between, to);
    vkb_join(levels, &first, &second);
    vkb_levels_pass(levels, &second);
}

// Adds the pass that makes `to` of the sum of the level below, by a cubic B-spline, or of an image
// of its own size, and of another image of this size (VKB_NO_IMAGE: none).
static void add_sum(struct vkb_levels *levels, uint32_t level, bool enlarged, uint32_t from,
                    uint32_t same_size, uint32_t to)
{
    const struct vkb_kernel kernels[][2] = {{vkb_centre(), vkb_centre()}};
    struct vkb_filter filter = vkb_make_filter(levels->graph, from, to, kernels, 1, 1.0);

    if (enlarged) {
        align(&filter, 0.5, level == 0 ? MARGIN : MARGIN / 2);
        vkb_set_kind(&filter, UPSAMPLE_CUBIC);
    }
    vkb_add_mixed_filter_pass(levels, &filter, from, same_size, 1.0, to);
}

// Adds the sum of the Gaussians of a level and of `below`, the sum of the level below it
// (VKB_NO_IMAGE: none). The last pass writes `end`, or an image of its own (VKB_NO_IMAGE). Returns
// the image of the sum.
static uint32_t add_level_sum(struct vkb_levels *levels, const struct gaussians *gaussians,
                              uint32_t level, uint32_t below, uint32_t end)
{
    uint32_t sum = below, left = 0;
    bool enlarged = below != VKB_NO_IMAGE;

    for (uint32_t i = 0; i < gaussians->count; ++i)
        left += gaussians->all[i].level == level;
    if (!left && enlarged) {
        const uint32_t to = end == VKB_NO_IMAGE
                              ? vkb_levels_step(levels, levels->sizes[level], "sum_%u", level)
                              : end;
        add_sum(levels, level, true, sum, VKB_NO_IMAGE, to);
        return to;
    }
    for (uint32_t i = 0; i < gaussians->count; ++i) {
        const struct gaussian *gaussian = &gaussians->all[i];
        const struct vkb_size size = levels->sizes[level];
        if (gaussian->level != level)
            continue;
        const bool last = --left == 0 && end != VKB_NO_IMAGE;
        const uint32_t blurred =
            last && sum == VKB_NO_IMAGE ? end : vkb_levels_step(levels, size, "gaussian_%u", i);
        add_gaussian(levels, gaussian, i, blurred);
        if (sum == VKB_NO_IMAGE) {
            sum = blurred;
            continue;
        }
        const uint32_t to = last ? end : vkb_levels_step(levels, size, "sum_%u_%u", level, i);
        add_sum(levels, level, enlarged, sum, blurred, to);
        sum = to;
        enlarged = false;
    }
    return sum;
}

// Adds the sum of all Gaussians of the source's glow.
static uint32_t add_gaussians(struct vkb_levels *levels, const struct gaussians *gaussians)
{
    const struct vkb_bloom_source *source = levels->source;
    const struct vkb_size size = source->buffers;
    const bool same = size.width == source->final.width && size.height == source->final.height;
    // Strips are for images of one format: with an enlargement into half floats a call takes 169 ms
    // in place of 138 (processor time of 1920 x 1080, lavapipe of Mesa 22.3.6, 2026-11-29).
    const bool direct = same && source->format == VKB_FORMAT_RGBA32_FLOAT;
    uint32_t sum = VKB_NO_IMAGE;

    // Levels are floats, whatever the format of the bloom buffers is.
    struct vkb_bloom_source floats = *source;
    floats.format = VKB_FORMAT_RGBA32_FLOAT;
    levels->source = &floats;
    add_levels(levels, gaussians->levels);
    const uint32_t end = direct ? vkb_levels_target(levels, "bloom", source->format, size, true)
                                : vkb_levels_step(levels, size, "convolved");
    for (uint32_t level = gaussians->levels + 1; level-- > 0;)
        sum = add_level_sum(levels, gaussians, level, sum, level ? VKB_NO_IMAGE : end);
    levels->source = source;
    if (direct)
        return sum;
    if (!same)
        return vkb_levels_enlarge(levels, UPSAMPLE_LINEAR, sum, 1.0);
    const uint32_t bloom = vkb_levels_target(levels, "bloom", source->format, size, true);
    vkb_levels_resize(levels, sum, 1.0, bloom);
    return bloom;
}

uint32_t vkb_add_unreal_method(struct vkb_levels *levels)
{
    const struct vkb_bloom_source *source = levels->source;
    struct vkb_bloom_source masked = *source;
    struct gaussians gaussians;

    if (source->mask != VKB_NO_IMAGE || levels->settings->thresholded) {
        masked.glow = vkb_levels_step(levels, source->buffers, "highlights");
        struct vkb_pass_row row =
            vkb_describe_prefilter(levels, VKB_PREFILTER_unreal, source->glow, masked.glow);
        vkb_levels_masked(levels, &row);
    }
    levels->source = &masked;
    const uint32_t bloom =
        vkb_method_of(levels->settings)->sums_gaussians
                && find_gaussians(levels->settings, source->final, source->buffers, &gaussians)
            ? add_gaussians(levels, &gaussians)
            : vkb_add_convolution_method(levels);
    levels->source = source;
    return bloom;
}

// Film's halation: the kernel is a sum of Gaussians, too.
uint32_t vkb_add_halation_method(struct vkb_levels *levels)
{
    return vkb_add_unreal_method(levels);
}
