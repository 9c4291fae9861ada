// The adjoints of samples that are not on a grid: each texel gathers the cotangents of the pixels
// that sample it, which the shader finds.
#include "passes/adjoint.h"

#include <math.h>

// llvmpipe of Mesa 22.3 ends all loops of an invocation after 65535 iterations. The invocations
// that it runs together take as many as the slowest of them in each loop; neighbours take about
// as many.
enum { MAX_ITERATIONS = 1 << 15 };

// Twice the distance from a texel to a sample that it is part of, at most (adjoint_moved.frag).
static const double SAMPLED_WIDTH = 2.0 * 1.503;

// How many iterations a texel takes at most: at a distance from the centre, and for one row.
struct gathering {
    double (*iterations)(const struct gathering *gathering, double distance);
    struct vkb_size size;
    double centre_x, centre_y, of_row;
    const struct flare *flare;  // or
    // Of sun beams: how far a sample is from its pixel, and beyond the sun, at most.
    double most, beyond;
};

// The values of SUMMED_ROWS, and how many groups there are at all.
struct sums {
    int x, y, width, height, rows, groups;
};

// The texels of an axis that are no further away than the radius: the first one, and their number.
static void set_range(double centre, double radius, uint32_t side, int *first, int *count)
{
    const double low = fmax(ceil(centre - radius), 0.0);
    const double high = fmin(floor(centre + radius), side - 1.0);

    *first = low <= high ? (int)low : 0;
    *count = low <= high ? (int)(high - low) + 1 : 0;
}

// Finds the block of texels that take too many iterations, if there is one.
static struct sums find_sums(const struct gathering *gathering, uint32_t max_side)
{
    const struct vkb_size size = gathering->size;
    struct sums sums = {.rows = 1};
    double radius = 2.0;

    if (gathering->of_row * size.height <= MAX_ITERATIONS)
        return sums;
    while (radius < 2.0 * max_side && gathering->iterations(gathering, radius) > MAX_ITERATIONS)
        radius *= 1.25;
    set_range(gathering->centre_x, radius, size.width, &sums.x, &sums.width);
    set_range(gathering->centre_y, radius, size.height, &sums.y, &sums.height);
    if (sums.width == 0 || sums.height == 0)
        sums.width = sums.height = 0;
    sums.rows = (int)fmax(MAX_ITERATIONS / gathering->of_row, 1.0);
    sums.groups = ((int)size.height + sums.rows - 1) / sums.rows;
    return sums;
}

#define SET_SUMS(params, sums, first, count, across) \
    ((params)->summed_x = (sums)->x, (params)->summed_y = (sums)->y, \
     (params)->summed_width = (sums)->width, (params)->summed_height = (sums)->height, \
     (params)->summed_first = (first) * (sums)->rows, (params)->summed_rows = (sums)->rows, \
     (params)->summed_groups = (count), (params)->summed_columns = (across))

// Sets `count` groups from number `first` on, of which `across` are beside each other.
static void set_groups(struct vkb_pass_row *row, const struct sums *sums, int first, int count,
                       int across)
{
    if (row->block == VKB_BLOCK_flare)
        SET_SUMS(&row->params.flare, sums, first, count, across);
    else
        SET_SUMS(&row->params.sun_beams, sums, first, count, across);
}

// Accumulates what the row gathers, for which others add up groups of rows, if there are sums: as
// many at a time as an image of about the size of the source holds.
static bool accumulate_summed(struct vkb_adjoint *adjoint, const struct vkb_pass_row *given,
                              const struct gathering *gathering, uint32_t image,
                              struct vkb_error *error)
{
    const struct sums sums = find_sums(gathering, adjoint->max_side);
    const int most_across = sums.width ? (int)adjoint->max_side / sums.width : 1;
    const int most_down = sums.height ? (int)adjoint->max_side / sums.height : 1;
    const double pixels = (double)gathering->size.width * gathering->size.height;
    struct vkb_pass_row row = *given;

    set_groups(&row, &sums, 0, 0, 1);
    if (sums.width == 0)
        return vkb_accumulate_cotangent(adjoint, &row, image, error);
    const int held = (int)fmin(fmax(pixels / ((double)sums.width * sums.height), 1.0),
                               fmin(sums.groups, (double)most_across * most_down));
    const int across =
        (int)fmin(fmax(ceil(sqrt(held)), ceil((double)held / most_down)), most_across);
    for (int first = 0; first < sums.groups; first += held) {
        const int count = sums.groups - first < held ? sums.groups - first : held;
        const struct vkb_size size = {
            .width = (uint32_t)(across * sums.width),
            .height = (uint32_t)((count - 1) / across + 1) * (uint32_t)sums.height,
        };
        struct vkb_pass_row part = row;
        set_groups(&part, &sums, first, count, across);
        row = part;
        part.constants.partial_sums = true;
        part.reads[SLOT_SUMS] = VKB_NO_IMAGE;
        if (!vkb_add_adjoint_image(adjoint, &part, size, &row.reads[SLOT_SUMS], error)
            || !vkb_accumulate_cotangent(adjoint, &row, image, error))
            return false;
    }
    return true;
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
static double iterations_of_part(double reach, double distance, double thickness)
{
    const double across = reach * SAMPLED_WIDTH / 2.0 / distance + 1.0;
    const double between = fmin(thickness, reach), rows = 3.0 * across + between + 2.0;

    return 7.0 * rows + 2.0 * acos(-1.0) * across * between;
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
             * iterations_of_part(flare->reach, distance, SAMPLED_WIDTH / flare->scale + 2.0)
         + flare->more_parts
               * iterations_of_part(flare->reach, distance,
                                    (SAMPLED_WIDTH + spread) / flare->scale + 2.0);
}

// Of a row between two radii: a chord of the outer circle that touches the inner one, at most.
static double iterations_of_row(const struct flare *flare, double width)
{
    const double spread = flare->params->aberration * (flare->longer - flare->shorter);
    const double thickness =
        fmin((3.0 * SAMPLED_WIDTH + spread) / flare->scale + 2.0, flare->reach);
    const double chord = 2.0 * sqrt(2.0 * flare->reach * thickness) + 7.0;
    const double parts = flare->parts + flare->more_parts;

    // The parts of a colour have no pixel in common, but for the margins of their radii.
    return fmin(parts * chord, (flare->more_parts > 0.0 ? 3.0 : 1.0) * (width + 28.0));
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
    const struct vkb_image_row *image = &adjoint->graph->images[source];
    const struct vkb_size size = {image->width, image->height};
    const struct flare flare = flare_of(row, size);
    const struct gathering gathering = {
        .iterations = flare_iterations,
        .size = size,
        .centre_x = 0.5 * size.width - 0.5,
        .centre_y = 0.5 * size.height - 0.5,
        .of_row = iterations_of_row(&flare, size.width),
        .flare = &flare,
    };
    uint32_t sampled;

    if (!vkb_add_adjoint_image(adjoint, row, size, &sampled, error))
        return false;
    struct vkb_pass_row moved = vkb_adjoint_row(&vkb_shader_adjoint_moved_frag, VKB_NO_IMAGE);
    // The shader samples them as the forward pass samples the source.
    moved.reads[SLOT_SOURCE] = sampled;
    moved.block = row->block;
    moved.params = row->params;
    return accumulate_summed(adjoint, &moved, &gathering, source, error);
}

// Sun beams: four pixels of a strip behind the texel in an iteration.
static double beam_iterations(const struct gathering *gathering, double distance)
{
    const double x = gathering->centre_x, y = gathering->centre_y;
    const double width = gathering->size.width, height = gathering->size.height;
    const double reach =
        hypot(fmax(fabs(x), fabs(width - x)), fmax(fabs(y), fabs(height - y))) + 1.0;
    const double outer = fmin(distance + gathering->most + SAMPLED_WIDTH, reach);
    const double across = outer * SAMPLED_WIDTH / 2.0 / distance + 1.0;
    const double rows = fmin(3.0 * across + outer + 2.0, height);

    return (distance > gathering->beyond ? 1.0 : 2.0) * (8.0 * rows + across * outer / 2.0);
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
        .of_row = image->width / 4.0 + 14.0,
        .most = left > 0.0 ? params->most + 2.0 + beyond : 4.0,
        .beyond = beyond + 2.0,
    };
    struct vkb_pass_row row = vkb_adjoint_row(&vkb_shader_adjoint_beam_means_frag, cotangents);
    uint32_t sums;

    row.block = VKB_BLOCK_sun_beams;
    row.params = pass->params;
    if (!vkb_add_adjoint_row(adjoint, &row, gathering.size, &sums, error))
        return false;
    row.shader = &vkb_shader_adjoint_beams_frag;
    row.reads[SLOT_COTANGENTS] = sums;
    return accumulate_summed(adjoint, &row, &gathering, source, error);
}
