// The adjoints of samples that are not on a grid: each texel gathers the cotangents of the pixels
// that sample it, which the shader finds.
#include "passes/adjoint.h"

#include <math.h>
#include <string.h>

// llvmpipe of Mesa 22.3 ends all loops of an invocation after 65535 iterations. The invocations
// that it runs together take as many as the slowest of them in each loop; neighbours take about
// as many. On a GPU all others wait for the invocation with the most iterations, so that these are
// as few as an image of sums with a part of the source's pixels allows.
enum { MIN_ITERATIONS = 512, MAX_ITERATIONS = 1 << 15, PART_OF_PIXELS = 4 };

// Twice the distance from a texel to a sample that it is part of, at most (adjoint_moved.frag).
static const double SAMPLED_WIDTH = 2.0 * 1.503;

// About how many iterations a texel takes at most, at a distance from the centre.
struct gathering {
    double (*iterations)(const struct gathering *gathering, double distance);
    struct vkb_size size;
    double centre_x, centre_y;
    int cell;                   // the side of the cells of texels that blocks have
    const struct flare *flare;  // or
    // Of sun beams: how far a sample is from its pixel, and beyond the sun, at most.
    double most, beyond;
};

// The values of SUMMED_ROWS, and the size of the image of sums.
struct sums {
    float blocks[2 * MAX_SUMMED][4];
    int count;
    struct vkb_size size;
};

// The texels of an axis that are no further away than the radius, in complete cells: the first one,
// and their number.
static void set_range(double centre, double radius, uint32_t side, int cell, float *first,
                      float *count)
{
    const double low = floor(fmax(centre - radius, 0.0) / cell);
    const double high = floor(fmin(centre + radius, side - 1.0) / cell);

    *first = low <= high ? (float)(cell * low) : 0.0f;
    *count = low <= high ? (float)(cell * (high - low + 1.0)) : 0.0f;
}

// Makes the blocks of texels that take more than `most` iterations. Each block is twice as large as
// the one in it, and has as many groups as the texels around that one need.
static struct sums make_blocks(const struct gathering *gathering, double most)
{
    const struct vkb_size size = gathering->size;
    const double lines = fmax(size.width, size.height);
    struct sums sums = {.count = 0};
    double inner = 0.0;

    for (double radius = 2.0; sums.count < MAX_SUMMED; radius *= 2.0) {
        const double groups = ceil(gathering->iterations(gathering, inner) / most);
        float *place = sums.blocks[2 * sums.count];
        if (groups <= 1.0)
            break;
        set_range(gathering->centre_x, radius, size.width, gathering->cell, &place[0], &place[2]);
        set_range(gathering->centre_y, radius, size.height, gathering->cell, &place[1], &place[3]);
        inner = radius;
        if (place[2] == 0.0f || place[3] == 0.0f)
            continue;
        // A group has at least a line of pixels.
        sums.blocks[2 * sums.count++ + 1][0] = (float)fmin(groups, lines);
    }
    return sums;
}

// Places the groups of all blocks below each other. False: the image would be too high, or have
// more pixels than it may.
static bool place_groups(struct sums *sums, uint32_t max_side, double max_pixels)
{
    double pixels = 0.0, height = 0.0, width = 1.0;

    for (int i = 0; i < sums->count; ++i) {
        const float *place = sums->blocks[2 * i];
        pixels += (double)place[2] * place[3] * sums->blocks[2 * i + 1][0];
        width = fmax(width, place[2]);
    }
    width = fmin(fmax(width, ceil(sqrt(pixels))), max_side);
    for (int i = 0; i < sums->count; ++i) {
        const float *place = sums->blocks[2 * i];
        float *groups = sums->blocks[2 * i + 1];
        groups[1] = fminf(floorf((float)width / place[2]), groups[0]);
        groups[2] = (float)height;
        height += ceil(groups[0] / groups[1]) * place[3];
    }
    sums->size = (struct vkb_size){(uint32_t)width, (uint32_t)fmin(height, max_side)};
    return height <= max_side && pixels <= max_pixels;
}

static struct sums find_sums(const struct gathering *gathering, uint32_t max_side)
{
    const double pixels = (double)gathering->size.width * gathering->size.height;
    double most = MIN_ITERATIONS;
    struct sums sums = make_blocks(gathering, most);

    for (; !place_groups(&sums, max_side, pixels / PART_OF_PIXELS) && most < MAX_ITERATIONS;
         most *= 2.0)
        sums = make_blocks(gathering, 2.0 * most);
    return sums;
}

static void set_sums(struct vkb_pass_row *row, const struct sums *sums)
{
    const bool flare = row->block == VKB_BLOCK_flare;
    struct vkb_flare_params *flares = &row->params.flare;
    struct vkb_sun_beams_params *beams = &row->params.sun_beams;

    *(flare ? &flares->summed_blocks : &beams->summed_blocks) = sums->count;
    memcpy(flare ? flares->summed : beams->summed, sums->blocks, sizeof sums->blocks);
}

// Accumulates what the row gathers, for which another one adds up groups of pixels, if there are
// sums.
static bool accumulate_summed(struct vkb_adjoint *adjoint, const struct vkb_pass_row *given,
                              const struct gathering *gathering, uint32_t image,
                              struct vkb_error *error)
{
    const struct sums sums = find_sums(gathering, adjoint->max_side);
    struct vkb_pass_row row = *given, first;

    set_sums(&row, &sums);
    first = row;
    first.constants.partial_sums = true;
    return (sums.count == 0
            || vkb_add_adjoint_image(adjoint, &first, sums.size, &row.reads[SLOT_SUMS], error))
        && vkb_accumulate_cotangent(adjoint, &row, image, error);
}

// What bounds the work of a halo or a ghost.
struct flare {
    const struct vkb_flare_params *params;
    double scale, reach;       // of the samples; of the pixels from the centre
    double longer, shorter;    // sides of the image
    double parts, more_parts;  // of the pixels: those of all colours; those of red and blue, too
};

// A part of the pixels is a strip around the texel's line, between two radii. The loops over a row
// and its sides take three iterations, and the ends of its pixels four.
static double iterations_of_part(const struct gathering *gathering, double distance,
                                 double thickness)
{
    const double reach = gathering->flare->reach, height = gathering->size.height;
    const double pixels = (double)gathering->size.width * gathering->size.height;
    const double across = fmin(reach * SAMPLED_WIDTH / 2.0 / distance + 1.0, reach);
    const double between = fmin(thickness, reach);
    const double rows = fmin(3.0 * across + between + 2.0, height);

    return 7.0 * rows + fmin(2.0 * acos(-1.0) * across * between, pixels);
}

static double flare_iterations(const struct gathering *gathering, double distance)
{
    const struct flare *flare = gathering->flare;
    const double longer = flare->longer, shorter = flare->shorter;
    const double aberration = flare->params->aberration;
    // By how much the distances differ by which red and blue are moved: these depend on the
    // direction.
    const double angle = 2.0 * asin(fmin(0.5 * SAMPLED_WIDTH / distance, 1.0));
    const double slope = longer * (longer * longer - shorter * shorter) / (2.0 * shorter * shorter);
    const double spread = aberration * fmin(longer - shorter, angle * slope);

    if (distance > flare->scale * flare->reach + aberration * longer + SAMPLED_WIDTH)
        return 0.0;
    return flare->parts
             * iterations_of_part(gathering, distance, SAMPLED_WIDTH / flare->scale + 2.0)
         + flare->more_parts
               * iterations_of_part(gathering, distance,
                                    (SAMPLED_WIDTH + spread) / flare->scale + 2.0);
}

static struct flare flare_of(const struct vkb_pass_row *row, struct vkb_size size)
{
    const struct vkb_flare_params *params = &row->params.flare;
    const double width = size.width, height = size.height, most = 0.5 * hypot(width, height) + 1.0;
    const bool halo = params->count == 0;
    // Those outwards and those inwards; of red there are two of each.
    const double parts = halo ? 2.0 : 1.0;

    return (struct flare){
        .params = params,
        .scale = halo ? 1.0 : fabs((double)params->ghosts[0][3]),
        .reach = halo ? fmin(most, (params->radius + params->width) * height + 1.0) : most,
        .longer = fmax(width, height),
        .shorter = fmin(width, height),
        .parts = parts,
        .more_parts = params->aberration > 0.0f ? 3.0 * parts : 0.0,
    };
}

bool vkb_accumulate_moved(struct vkb_adjoint *adjoint, const struct vkb_pass_row *row,
                          uint32_t source, struct vkb_error *error)
{
    const struct vkb_size size = vkb_size_of(adjoint->graph, source);
    const struct flare flare = flare_of(row, size);
    const struct gathering gathering = {
        .iterations = flare_iterations,
        .size = size,
        .centre_x = 0.5 * size.width - 0.5,
        .centre_y = 0.5 * size.height - 0.5,
        .cell = 1,
        .flare = &flare,
    };
    uint32_t sampled;

    if (!vkb_add_adjoint_image(adjoint, row, size, &sampled, error))
        return false;
    struct vkb_pass_row moved = vkb_adjoint_row(&vkb_shader_adjoint_moved_frag, VKB_NO_IMAGE);
    // The shader samples them as the forward pass samples the source.
    moved.reads[SLOT_SOURCE] = sampled;
    moved.constants.aberrated = row->constants.aberrated;
    moved.block = row->block;
    moved.params = row->params;
    return accumulate_summed(adjoint, &moved, &gathering, source, error);
}

// Sun beams: of each line across the longer axis the pixels between two slopes, which differ by
// less than six texels over the distance on that axis, and the ends of a line.
static double beam_iterations(const struct gathering *gathering, double distance)
{
    const double x = gathering->centre_x, y = gathering->centre_y;
    const double width = gathering->size.width, height = gathering->size.height;
    const double reach =
        hypot(fmax(fabs(x), fabs(width - x)), fmax(fabs(y), fabs(height - y))) + 1.0;
    const double outer = fmin(distance + gathering->most + SAMPLED_WIDTH, reach);
    const double lines = fmin(2.0 * outer, fmax(width, height));
    const double slope = 6.0 / fmax(distance / sqrt(2.0) - 2.0, 0.1);
    const double inner = fmin(distance, outer);
    const double pixels = fmin(slope * (outer * outer - inner * inner) / 2.0, width * height);

    return (distance > gathering->beyond ? 1.0 : 2.0) * (4.0 * lines + pixels);
}

// Lets the row pass over highlights that are 0 without a slope. A mask only multiplies them: its
// cotangents are products with these zeros.
static void pass_over_dark(const struct vkb_graph *graph, uint32_t highlights,
                           struct vkb_pass_row *row)
{
    const struct vkb_pass_row *pass = vkb_graph_writer(graph, highlights);

    if (!pass || pass->block != VKB_BLOCK_prefilter || pass->constants.after != POINT_HIGHLIGHTS
        || !pass->constants.thresholded)
        return;
    const struct vkb_prefilter_params *params = &pass->params.prefilter;
    row->reads[SLOT_SOURCE] = pass->reads[SLOT_SOURCE];
    row->constants.thresholded = true;
    // Where the transition begins (lib/points.glsl).
    row->params.sun_beams.dark_below =
        params->threshold - fminf(params->smoothness, fminf(params->threshold, params->maximum));
    row->params.sun_beams.dark_side = pass->constants.mean_side > 1 ? pass->constants.mean_side : 1;
}

bool vkb_transpose_sun_beams(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                             struct vkb_error *error)
{
    const uint32_t source = pass->reads[SLOT_SOURCE], cotangents = vkb_cotangent_of(adjoint, pass);
    const struct vkb_image_row *image = &adjoint->graph->images[source];
    const struct vkb_sun_beams_params *params = &pass->params.sun_beams;
    const double left = params->left;
    const double beyond = left >= 1.0 ? 0.0 : left > 0.0 ? 2.0 / left : 2.0;
    const struct gathering gathering = {
        .iterations = beam_iterations,
        .size = {image->width, image->height},
        .centre_x = params->sun_x * (double)image->width - 0.5,
        .centre_y = params->sun_y * (double)image->height - 0.5,
        .cell = BEAM_CELL,
        .most = left > 0.0 ? params->most + 2.0 + beyond : 4.0,
        .beyond = beyond + 2.0,
    };
    struct vkb_pass_row row = vkb_adjoint_row(&vkb_shader_adjoint_beam_means_frag, cotangents);
    uint32_t sums;

    row.constants.jittered = pass->constants.jittered;
    row.block = VKB_BLOCK_sun_beams;
    row.params = pass->params;
    if (!vkb_add_adjoint_pass(adjoint, &row, gathering.size, &sums, error))
        return false;
    row.shader = &vkb_shader_adjoint_beams_comp;
    row.geometry = VKB_GEOMETRY_DISPATCH;
    row.vertex = NULL;
    row.variant = "dispatch";
    row.block_width = row.block_height = BEAM_CELL * PIXEL_INVOCATIONS;
    row.reads[SLOT_COTANGENTS] = sums;
    pass_over_dark(adjoint->graph, source, &row);
    return accumulate_summed(adjoint, &row, &gathering, source, error);
}
