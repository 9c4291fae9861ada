#include "passes/host_fft.h"

#include "passes/host_loops.h"

#include <math.h>
#include <string.h>

// M_PI is no part of C11.
static const double FULL_TURN = 6.283185307179586476925;

static bool find_factors(uint32_t length, struct vkb_host_line *line)
{
    static const uint32_t factors[] = {4, 2, 3, 5};

    for (size_t i = 0; i < sizeof factors / sizeof factors[0]; ++i)
        for (; length % factors[i] == 0 && line->factor_count < VKB_MAX_FACTORS;
             length /= factors[i])
            line->factors[line->factor_count++] = factors[i];
    return length == 1;
}

bool vkb_host_line_create(uint32_t length, struct vkb_host_line *line, struct vkb_error *error)
{
    *line = (struct vkb_host_line){.length = length};
    if (!find_factors(length, line))
        return vkb_fail(error, VKB_ERROR_GENERAL, "a line of %u elements cannot be transformed",
                        length);
    if (!(line->turns = vkb_alloc(error, (size_t)2 * length, sizeof *line->turns)))
        return false;
    float *turn = line->turns;
    uint32_t before = 1;
    for (uint32_t step = 0; step < line->factor_count; ++step) {
        const uint32_t factor = line->factors[step], rest = length / before / factor;
        for (uint32_t i = 0; i < rest; ++i)
            for (uint32_t j = 1; j < factor; ++j) {
                const double angle = FULL_TURN * ((double)before * i * j / length);
                *turn++ = (float)cos(angle);
                *turn++ = (float)-sin(angle);
            }
        before *= factor;
    }
    return true;
}

void vkb_host_line_destroy(struct vkb_host_line *line)
{
    vkb_free(line->turns);
    *line = (struct vkb_host_line){0};
}

// The place in the source of an element of a line, as load_padded() has it in padded.glsl.
static int32_t place_of(const struct vkb_pass_row *pass, int32_t along)
{
    const struct vkb_fft_params *params = &pass->params.fft;
    const int32_t extent = params->extent, inside = along - params->first;
    const bool behind = along < params->turn;
    int32_t place = behind ? extent - 1 : 0;

    if (!pass->constants.padded)
        return along;
    if (inside >= 0 && inside < extent)
        return inside;
    if (pass->constants.boundary == BOUNDARY_ZERO)
        return -1;
    if (pass->constants.boundary == BOUNDARY_WRAP)
        place = behind ? along - extent : along - params->padded + extent;
    else if (pass->constants.boundary == BOUNDARY_MIRROR)
        place = (behind ? 2 * extent : params->padded) - 1 - along;
    return place < 0 ? 0 : place < extent ? place : extent - 1;
}

// What is not the same for rows and columns is left to the caller.
static bool prepare(const struct vkb_pass_row *pass, const struct vkb_host_image *reads,
                    const struct vkb_host_image *target, struct vkb_host_lines *work,
                    struct vkb_error *error)
{
    const struct vkb_fft_params *params = &pass->params.fft;
    const uint32_t length = (uint32_t)params->padded, lanes = vkb_host_loops()->lanes;

    *work = (struct vkb_host_lines){
        .half = pass->transform.width / 2 + 1,
        .channels = pass->transform.channels,
        .kept = (uint32_t)params->kept,
        .source = reads[SLOT_SOURCE],
        .target = *target,
        .kernel = reads[SLOT_SPECTRUM],
        .weights = reads[SLOT_WEIGHTS],
        .added = reads[SLOT_ADDED],
        .kernel_sign = params->kernel_sign,
        .weight = params->weight,
        .before_x = params->before_x,
        .before_y = params->before_y,
        // With space for the alignment of vectors.
        .space_size = ((size_t)4 * length * lanes * sizeof(float) + 63) & ~(size_t)63,
    };
    if (!vkb_host_line_create(length, &work->line, error)
        || !(work->places = vkb_alloc(error, length, sizeof *work->places))
        || !(work->space = vkb_alloc(error, VKB_MAX_PARTS * work->space_size + 64, 1)))
        return false;
    for (uint32_t i = 0; i < length; ++i)
        work->places[i] = place_of(pass, (int32_t)i);
    return true;
}

// Runs the loop if everything is prepared, and frees what is.
static bool run_loop(struct vkb_host_lines *work, bool prepared, vkb_rows *loop, uint32_t blocks,
                     struct vkb_workers *workers)
{
    const size_t size = work->source.pitch * sizeof(float) * work->source.height;
    char *space = work->space;

    if (prepared) {
        work->space += -(uintptr_t)space & 63;
        vkb_in_parts(workers, loop, NULL, work, 0, blocks, size);
    }
    vkb_free(space);
    vkb_free(work->places);
    vkb_host_line_destroy(&work->line);
    return prepared;
}

bool vkb_host_rows_forth(const struct vkb_pass_row *pass, const struct vkb_host_image *reads,
                         const struct vkb_host_image *target, struct vkb_workers *workers,
                         struct vkb_error *error)
{
    struct vkb_host_lines work;
    const bool prepared = prepare(pass, reads, target, &work, error);

    work.cleans = pass->constants.stage == STAGE_FIRST;
    return run_loop(&work, prepared, vkb_host_loops()->rows_forth, (target->height + 3) / 4,
                    workers);
}

// As fft_kernel.comp has them, for all places of a padded line.
static struct vkb_kernel_places *find_places(int32_t padded, int boundary, int32_t extent,
                                             const int32_t ends[2], int32_t period, int32_t before,
                                             int32_t after, struct vkb_error *error)
{
    struct vkb_kernel_places *places = vkb_alloc(error, (size_t)padded, sizeof *places);

    for (int32_t at = 0; places && at < padded; ++at) {
        const int32_t offset = at <= after ? at : at - padded, place = extent / 2 + offset;
        places[at] = (struct vkb_kernel_places){place, place, 1};
        if (offset < -before)
            places[at] = (struct vkb_kernel_places){0, -1, 1};
        else if (boundary == BOUNDARY_EDGE && offset == -before)
            places[at].first = ends[0];
        else if (boundary == BOUNDARY_WRAP)
            places[at] = (struct vkb_kernel_places){
                ends[0] + ((place - ends[0]) % period + period) % period, ends[1], period};
        if (boundary == BOUNDARY_EDGE && offset == after)
            places[at].last = ends[1];
    }
    return places;
}

bool vkb_host_kernel_rows(const struct vkb_pass_row *pass, const struct vkb_host_image *reads,
                          const struct vkb_host_image *target, struct vkb_workers *workers,
                          struct vkb_error *error)
{
    const struct vkb_fft_kernel_params *params = &pass->params.fft_kernel;
    const uint32_t length = (uint32_t)params->padded_x, lanes = vkb_host_loops()->lanes;
    const uint32_t half = length / 2 + 1;
    struct vkb_host_lines work = {
        .half = half,
        .channels = pass->transform.channels,
        .source = reads[SLOT_SOURCE],
        .target = *target,
        .gain = params->gain,
        .space_size = ((size_t)6 * length * lanes * sizeof(float) + 63) & ~(size_t)63,
    };
    const bool prepared =
        vkb_host_line_create(length, &work.line, error)
        && (work.kernel_x = find_places(params->padded_x, params->boundary_x, params->extent_x,
                                        (const int32_t[]){params->first_x, params->last_x},
                                        params->period_x, params->before_x, params->after_x, error))
        && (work.kernel_y = find_places(params->padded_y, params->boundary_y, params->extent_y,
                                        (const int32_t[]){params->first_y, params->last_y},
                                        params->period_y, params->before_y, params->after_y, error))
        && (work.space = vkb_alloc(error, VKB_MAX_PARTS * work.space_size + 64, 1));
    const bool done = run_loop(&work, prepared, vkb_host_loops()->kernel_rows,
                               (target->height + 2 * lanes - 1) / (2 * lanes), workers);

    vkb_free(work.kernel_x);
    vkb_free(work.kernel_y);
    return done;
}

bool vkb_host_columns(const struct vkb_pass_row *pass, const struct vkb_host_image *reads,
                      const struct vkb_host_image *target, struct vkb_workers *workers,
                      struct vkb_error *error)
{
    struct vkb_host_lines work;
    const bool prepared = prepare(pass, reads, target, &work, error);
    const uint32_t lanes = vkb_host_loops()->lanes;

    work.forth = !pass->constants.inverse;
    work.back = pass->constants.inverse || work.kernel.pixels;
    return run_loop(&work, prepared, vkb_host_loops()->columns,
                    (work.half + lanes - 1) / lanes * work.channels, workers);
}

bool vkb_host_rows_back(const struct vkb_pass_row *pass, const struct vkb_host_image *reads,
                        const struct vkb_host_image *target, struct vkb_workers *workers,
                        struct vkb_error *error)
{
    struct vkb_host_lines work;
    const bool prepared = prepare(pass, reads, target, &work, error);

    work.stores = pass->constants.stage == STAGE_LAST;
    work.opaque = pass->constants.alpha != ALPHA_BLUR;
    return run_loop(&work, prepared, vkb_host_loops()->rows_back, (target->height + 3) / 4,
                    workers);
}

// Frequencies of one channel in a row, which are added to what `to` has.
static void add_product(const float *glow, const float *kernel, float sign, uint32_t half,
                        float *to)
{
    const float *glow_im = glow + half, *kernel_im = kernel + half;
    float *to_im = to + half;

    for (uint32_t k = 0; k < half; ++k) {
        const float im = sign * kernel_im[k];
        to[k] += glow[k] * kernel[k] - glow_im[k] * im;
        to_im[k] += glow[k] * im + glow_im[k] * kernel[k];
    }
}

struct products {
    const struct vkb_pass_row *pass;
    const struct vkb_host_image *reads, *target;
};

static void add_products(void *context, uint32_t part, uint32_t first, uint32_t end)
{
    const struct products *work = context;
    const struct vkb_transform *transform = &work->pass->transform;
    const uint32_t half = transform->width / 2 + 1;
    const float sign = work->pass->params.products.kernel_sign;
    const struct vkb_host_image *sum = &work->reads[SLOT_SOURCE];

    (void)part;
    for (uint32_t y = first; y < end; ++y)
        for (uint32_t channel = 0; channel < transform->channels; ++channel) {
            const size_t at = (size_t)2 * channel * half, size = (size_t)2 * half * sizeof(float);
            float *to = work->target->pixels + y * work->target->pitch + at;
            if (sum->pixels)
                memcpy(to, sum->pixels + y * sum->pitch + at, size);
            else
                memset(to, 0, size);
            for (int32_t i = 0; i < work->pass->constants.products; ++i) {
                const struct vkb_host_image *factors = &work->reads[SLOT_FACTORS + 2 * i];
                const size_t of_kernel = vkb_host_is_grey(&factors[1], half) ? 0 : at;
                add_product(factors[0].pixels + y * factors[0].pitch + at,
                            factors[1].pixels + y * factors[1].pitch + of_kernel, sign, half, to);
            }
        }
}

bool vkb_host_products(const struct vkb_pass_row *pass, const struct vkb_host_image *reads,
                       const struct vkb_host_image *target, struct vkb_workers *workers,
                       struct vkb_error *error)
{
    struct products work = {pass, reads, target};

    (void)error;
    vkb_in_parts(workers, add_products, NULL, &work, 0, target->height,
                 target->pitch * sizeof(float) * target->height);
    return true;
}
