// The loop of host_beams.h, for vectors of LANES floats (host_lanes.h). It computes what
// sun_beams.frag does, with the names of lib/beam.glsl.
#include "passes/host_beams.h"

#include <math.h>

// Samples are found in runs, and added up when some runs are found: so their weights are in memory,
// from where each is loaded to all lanes at once.
enum { BEAM_PARTS = BEAM_RUN / LANES, MAX_SAMPLES = 8 * BEAM_RUN };

// The samples of a pixel, in texels of the image with a border.
struct beam {
    float x, y, towards_x, towards_y;
    int32_t last;
    // How many steps away sample i is: i * apart + offset. What a step takes from the weight's
    // root.
    float apart, offset, less;
};

// Of each sample the first of its two texels in the upper row, the weights of both, and the part of
// the lower row.
struct samples {
    int32_t texels[MAX_SAMPLES];
    float left[MAX_SAMPLES], right[MAX_SAMPLES], lower[MAX_SAMPLES];
};

// Two texels next to each other.
struct pair {
    lanes parts[8 / LANES];
};

struct beam_sums {
    struct pair left, right;
    lanes weights[BEAM_PARTS], alpha[BEAM_PARTS];
};

INLINE uint32_t turned(uint32_t value, uint32_t count)
{
    return value << count | value >> (32 - count);
}

INLINE float hashed(uint32_t x, uint32_t y)
{
    static const uint32_t counts[] = {14, 11, 25, 16, 4, 14, 24};
    const uint32_t start = UINT32_C(0xdeadbeef) + 8 + 13;
    uint32_t a = start, b = start + y, c = start + x;

    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; ++i) {
        const uint32_t mixed = (a ^ b) - turned(b, counts[i]);
        a = c;
        c = b;
        b = mixed;
    }
    return (float)b / 4294967295.0f;
}

// Whether a sample is in the image, by its share of the sides.
INLINE bool is_place(const struct vkb_host_beams *work, const struct beam *beam, int32_t number)
{
    const float width = (float)work->target.width, height = (float)work->target.height;
    const float at = (float)number * beam->apart + beam->offset;
    const float x = (beam->x - 0.5f + at * beam->towards_x) / width;
    const float y = (beam->y - 0.5f + at * beam->towards_y) / height;

    return x >= 0.0f && y >= 0.0f && x <= 1.0f && y <= 1.0f;
}

// The samples after one that is outside are outside, too.
static int32_t last_inside(const struct vkb_host_beams *work, const struct beam *beam)
{
    int32_t inside = -1, outside = beam->last;

    if (is_place(work, beam, beam->last))
        return beam->last;
    while (outside - inside > 1) {
        const int32_t middle = inside + (outside - inside) / 2;
        if (is_place(work, beam, middle))
            inside = middle;
        else
            outside = middle;
    }
    return inside;
}

static struct beam beam_of(const struct vkb_host_beams *work, uint32_t x, uint32_t y)
{
    const struct vkb_sun_beams_params *params = work->params;
    const double width = work->target.width, height = work->target.height;
    const double sun_x = params->sun_x * width, sun_y = params->sun_y * height;
    // Blender measures from the pixel's lower left corner.
    const double away_x = x - sun_x, away_y = y + 1.0 - sun_y;
    const double distance = fmax(sqrt(away_x * away_x + away_y * away_y), 1.0);
    const float steps = (float)(distance < params->most ? (int32_t)distance : params->most);
    struct beam beam = {
        .x = (float)x + 1.0f,
        .y = (float)y + 1.0f,
        .towards_x = (float)((sun_x - x - 0.5) / distance),
        .towards_y = (float)((sun_y - y - 0.5) / distance),
        .last = (int32_t)(params->left * steps),
        .apart = 1.0f,
        .less = 1.0f / steps,
    };

    if (work->jittered) {
        beam.apart = params->left > 0.0f ? 1.0f / params->left : 0.0f;
        beam.offset = hashed(x, work->target.height - 1 - y) * beam.apart;
    }
    beam.last = last_inside(work, &beam);
    return beam;
}

// The alpha of the samples from a texel on, if they are black; -1: they may have light.
INLINE float dark_alpha(const struct vkb_host_beams *work, int32_t x, int32_t y)
{
    const struct vkb_host_image *dark = &work->dark;
    const uint32_t column = clamped(x - 1, work->target.width) / BEAM_BLOCK;
    const uint32_t row = clamped(y - 1, work->target.height) / BEAM_BLOCK;

    return dark->pixels ? dark->pixels[row * dark->pitch + (size_t)4 * column + 3] : -1.0f;
}

// Finds the samples from `first` on, as those from `count` on. Those after the last one of the beam
// have the weight 0. Returns the alpha of a run in the dark that begins with them.
INLINE float find_part(const struct vkb_host_beams *work, const struct beam *beam, int32_t first,
                       struct samples *samples, size_t count, lanes *weights)
{
    const int32_t numbers[] = {0, 1, 2, 3, 4, 5, 6, 7};
    lane_bits number, is_one;

    memcpy(&number, numbers, sizeof number);
    number += first;
    is_one = number <= beam->last;
    number = (number & is_one) | (beam->last & ~is_one);
    const lanes at = __builtin_convertvector(number, lanes) * beam->apart + beam->offset;
    // No sample is above or left of the border, so these are the integers below.
    const lanes x = at * beam->towards_x + beam->x, y = at * beam->towards_y + beam->y;
    const lane_bits column = __builtin_convertvector(x, lane_bits);
    const lane_bits row = __builtin_convertvector(y, lane_bits);
    const lane_bits texels = row * (int32_t)work->source.pitch + column * 4;
    const lanes lower = y - __builtin_convertvector(row, lanes), rest = 1.0f - at * beam->less;
    *weights = (lanes)((lane_bits)(rest * rest) & is_one);
    const lanes right = *weights * (x - __builtin_convertvector(column, lanes));
    const lanes left = *weights - right;
    memcpy(samples->texels + count, &texels, sizeof texels);
    memcpy(samples->lower + count, &lower, sizeof lower);
    memcpy(samples->left + count, &left, sizeof left);
    memcpy(samples->right + count, &right, sizeof right);
    return dark_alpha(work, column[0], row[0]);
}

// Finds the run from the sample `first` on, and adds its weights. Returns how many samples there
// are then: a run in the dark has nothing else to add but its alpha.
INLINE size_t find_run(const struct vkb_host_beams *work, const struct beam *beam, int32_t first,
                       struct samples *samples, size_t count, struct beam_sums *sums)
{
    float alpha = 0.0f;

    for (int32_t i = 0; i < BEAM_PARTS; ++i) {
        lanes weights;
        const float found =
            find_part(work, beam, first + i * LANES, samples, count + (size_t)i * LANES, &weights);
        alpha = i == 0 ? found : alpha;
        sums->weights[i] += weights;
        if (alpha >= 0.0f)
            sums->alpha[i] += weights * alpha;
    }
    return alpha >= 0.0f ? count : count + BEAM_RUN;
}

INLINE void add_sample(const struct vkb_host_image *source, const struct samples *samples, size_t i,
                       struct pair *left, struct pair *right)
{
    const float *upper = source->pixels + samples->texels[i];
    struct pair above, below;

    memcpy(&above, upper, sizeof above);
    memcpy(&below, upper + source->pitch, sizeof below);
    for (int32_t part = 0; part < 8 / LANES; ++part) {
        const lanes between = above.parts[part];
        const lanes colours = between + samples->lower[i] * (below.parts[part] - between);
        left->parts[part] += samples->left[i] * colours;
        right->parts[part] += samples->right[i] * colours;
    }
}

// A run is added up before it is added to the others, so that processors begin the next one
// meanwhile.
INLINE void add_samples(const struct vkb_host_beams *work, const struct samples *samples,
                        size_t count, struct beam_sums *sums)
{
    const struct vkb_host_image source = work->source;

    for (size_t first = 0; first < count; first += BEAM_RUN) {
        struct pair left = {{{0}}}, right = {{{0}}};
#pragma GCC unroll 8
        for (size_t i = 0; i < BEAM_RUN; ++i)
            add_sample(&source, samples, first + i, &left, &right);
        for (int32_t part = 0; part < 8 / LANES; ++part) {
            sums->left.parts[part] += left.parts[part];
            sums->right.parts[part] += right.parts[part];
        }
    }
}

INLINE float sum_of_run(const lanes *values)
{
    float run[BEAM_RUN], sum = 0.0f;

    memcpy(run, values, sizeof run);
    for (uint32_t i = 0; i < BEAM_RUN; ++i)
        sum += run[i];
    return sum;
}

static void write_beam(const struct vkb_host_beams *work, uint32_t x, uint32_t y)
{
    const struct beam beam = beam_of(work, x, y);
    const float *own = work->source.pixels + (y + 1) * work->source.pitch + (size_t)4 * (x + 1);
    float left[8], right[8], *pixel = work->target.pixels + y * work->target.pitch + (size_t)4 * x;
    struct beam_sums sums = {0};
    struct samples samples;

    for (int32_t number = 0; number <= beam.last;) {
        size_t count = 0;
        for (; number <= beam.last && count < MAX_SAMPLES; number += BEAM_RUN)
            count = find_run(work, &beam, number, &samples, count, &sums);
        add_samples(work, &samples, count, &sums);
    }
    const float weights = sum_of_run(sums.weights);
    memcpy(left, &sums.left, sizeof left);
    memcpy(right, &sums.right, sizeof right);
    right[4 + 3] += sum_of_run(sums.alpha);
    for (uint32_t i = 0; i < 4; ++i) {
        // A pixel without weights shows itself.
        const float value = weights > 0.0f ? (left[i] + right[4 + i]) / weights : own[i];
        // As limited() has it, but for NaN.
        const float limit = (float)SINGLE_LIMIT;
        pixel[i] = value > limit ? limit : value < -limit ? -limit : value;
    }
    if (!work->blurs_alpha)
        pixel[3] = 1.0f;
}

static void beams(void *context, uint32_t part, uint32_t first, uint32_t end)
{
    const struct vkb_host_beams *work = context;
    const uint32_t width = work->target.width, height = work->target.height;
    const uint32_t across = (width + VKB_BEAM_TILE - 1) / VKB_BEAM_TILE;

    (void)part;
    for (uint32_t tile = first; tile < end; ++tile) {
        const uint32_t left = tile % across * VKB_BEAM_TILE, top = tile / across * VKB_BEAM_TILE;
        for (uint32_t y = top; y < least(top + VKB_BEAM_TILE, height); ++y)
            for (uint32_t x = left; x < least(left + VKB_BEAM_TILE, width); ++x)
                write_beam(work, x, y);
    }
}
