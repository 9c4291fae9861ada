// Variants of blurs, and fused passes for the complete bloom of an image.
#include "variants/variant.h"

#include "passes/blur.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct vkb_shader *const line_shaders[VKB_FORMAT_COUNT] = VKB_BY_FORMAT(line_image);
static const struct vkb_shader *const strip_shaders[VKB_FORMAT_COUNT] = VKB_LINEAR_BY_FORMAT(strip);

// The row of a line blur. `origin` is the position of the target's first pixel in the source.
static struct vkb_pass_row line_row(const struct vkb_variant_choice *choice,
                                    const struct vkb_pass_row *blur, uint32_t target, int origin)
{
    const struct vkb_graph *graph = choice->graph;
    const struct vkb_image_row *image = &graph->images[target];
    const bool vertical = blur->filters->y.kernel.count > 0;
    const struct vkb_filter *filter = blur->filters;
    const struct vkb_kernel *kernel = vertical ? &filter->y.kernel : &filter->x.kernel;
    const int radius = (int)kernel->count - 1;
    struct vkb_pass_row row;

    memcpy(&row, blur, sizeof row);
    row.constants = (struct vkb_constants){.alpha = blur->constants.alpha};
    memset(&row.params, 0, sizeof row.params);
    // On a GPU a workgroup of one row of invocations would leave most of its lanes idle.
    const uint32_t rows = choice->variants == VKB_VARIANTS_GPU ? ROW_INVOCATIONS : 1;
    vkb_make_dispatch(&row, line_shaders[graph->images[blur->reads[SLOT_SOURCE]].format],
                      vertical ? ROW_INVOCATIONS : ROW_INVOCATIONS * LINE_OUTPUTS,
                      vertical ? rows * LINE_OUTPUTS : rows);
    row.constants.group_width = ROW_INVOCATIONS;
    row.constants.group_height = (int32_t)rows;
    row.reading = VKB_READING_LOADED;
    row.targets[0] = target;
    const bool is_short = radius <= LINE_SHORT_RADIUS;
    row.constants.rolled = choice->variants == VKB_VARIANTS_CPU && radius > 0
                        && radius <= LINE_ROLLED_RADIUS
                        && (!is_short || (uint64_t)image->width * image->height <= ROLLED_PIXELS);
    row.constants.unrolled_radius = is_short || row.constants.rolled ? radius : 0;
    if (!row.constants.rolled) {
        row.constants.direction = vertical ? DIRECTION_VERTICAL : DIRECTION_HORIZONTAL;
    } else {
        const uint32_t across = vertical ? image->width : image->height;
        const uint32_t along = vertical ? image->height : image->width;
        row.groups_width = (across + ROW_INVOCATIONS - 1) / ROW_INVOCATIONS;
        row.groups_height = (along + ROLLED_OUTPUTS - 1) / ROLLED_OUTPUTS;
    }
    row.block = VKB_BLOCK_line;
    row.params.line.radius = radius;
    row.params.line.origin = origin;
    row.params.line.vertical = vertical;
    row.params.line.levels = row.constants.rolled && image->format == VKB_FORMAT_RGBA8_UNORM;
    for (int tap = 0; tap <= 2 * radius; ++tap) {
        const int weight = abs(tap - radius);
        row.params.line.kernel[tap / 4][tap % 4] = (float)(filter->gain * kernel->weights[weight]);
    }
    return row;
}

static bool add_line_row(struct vkb_variant_choice *choice, const struct vkb_pass_row *row)
{
    vkb_add_variant_pass(choice, row);
    if (row->params.line.levels && !choice->failed)
        choice->graph->passes[choice->graph->pass_count - 1].constants.stored = STORED_SINGLE;
    return true;
}

// Adds a line blur if the source has the target's size.
bool vkb_add_line_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    if (!((vkb_line_of(pass, DIRECTION_VERTICAL, LINE_RADIUS)
           || vkb_line_of(pass, DIRECTION_HORIZONTAL, LINE_RADIUS))
          && vkb_same_size(&choice->plain, pass->reads[SLOT_SOURCE], pass->targets[0])
          && vkb_is_written_once(&choice->plain, pass->targets[0])))
        return false;
    struct vkb_pass_row row = line_row(choice, pass, pass->targets[0], 0);
    return add_line_row(choice, &row);
}

// For a horizontal blur into a target of another size whose taps are integer texels apart. Such a
// blur commutes with the filter between the sizes. So it runs at the source's size, and each pixel
// of the target takes one sample of the result instead of one for each tap. Without it
// `Separable(bloom_scale=0.5)` takes 243 ms in place of 62, `threejs_unreal` 120 in place of 69
// (processor time of 1920 x 1080 in float16, lavapipe of Mesa 22.3.6, 2026-11-27), the first at
// 3840 x 2160 on an H200 0.47 ms in place of 0.30.
static bool is_enlarged(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    if (!vkb_line_of(pass, DIRECTION_HORIZONTAL, LINE_RADIUS))
        return false;
    const struct vkb_image_row *source = &choice->plain.images[pass->reads[SLOT_SOURCE]];
    const struct vkb_image_row *target = &choice->plain.images[pass->targets[0]];

    return !vkb_same_size(&choice->plain, pass->reads[SLOT_SOURCE], pass->targets[0])
        && vkb_is_written_once(&choice->plain, pass->targets[0])
        && source->width + 2 <= choice->device->max_side
        && (target->format != VKB_FORMAT_RGBA8_UNORM
            || vkb_device_supports(choice->device, VKB_FORMAT_RGBA32_FLOAT,
                                   VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT));
}

bool vkb_add_enlarged_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    if (!is_enlarged(choice, pass))
        return false;
    const struct vkb_image_row *source = &choice->plain.images[pass->reads[SLOT_SOURCE]];
    const struct vkb_image_row *target = &choice->plain.images[pass->targets[0]];
    // The lines are floats, since rounding them would change the filtered values. The border has
    // the texels that the filter reads beyond the edges. In 8 bits the sampler filters the lines.
    const struct vkb_size size = {source->width + 2, source->height};
    const bool unorm = target->format == VKB_FORMAT_RGBA8_UNORM;
    char name[VKB_NAME_SIZE];
    snprintf(name, sizeof name, "%.24s_lines", pass->name);
    const uint32_t lines = vkb_add_float_image(choice, name, size);
    struct vkb_pass_row line = line_row(choice, pass, lines, -1);
    struct vkb_pass_row row =
        vkb_fullscreen_row(pass->name, &vkb_shader_enlarge_frag, pass->targets[0]);
    row.constants.sampling = unorm ? SAMPLING_FILTER : SAMPLING_FETCH;
    row.constants.alpha = pass->constants.alpha;
    vkb_read_only(&row, lines);
    row.block = VKB_BLOCK_threshold;
    // Not of `plain`: a new image may have moved these.
    VKB_SET_TARGET(&row, threshold, &choice->graph->images[pass->targets[0]]);
    return add_line_row(choice, &line) && vkb_add_fullscreen_variant(choice, &row);
}

// A bloom of the image by one filter, at its size: the last row of the filter, the threshold pass
// before it (NULL: there is none), and the composite after it. For the transpose these are rows of
// the adjoint, in the opposite order.
struct bloom {
    const struct vkb_pass_row *last, *threshold, *composite;
    const struct vkb_kernel *rows, *columns;
    double gain;
};

// Whether the transpose of a filter is this one row: the first of two has one of the axes.
static bool runs_whole(const struct vkb_pass_row *row, const struct vkb_filter *filter)
{
    const int32_t direction = row->constants.direction;

    return direction == DIRECTION_BOTH
        || vkb_axis_is_identity(direction == DIRECTION_VERTICAL ? &filter->x : &filter->y);
}

// Whether the row ends a filter along both axes by kernels that are not longer than `radius`, of an
// image of the target's size: *from. It sets the kernels.
static bool find_kernels(const struct vkb_pass_row *last, int radius, struct bloom *bloom,
                         uint32_t *from)
{
    const struct vkb_filter *filter = last->joined_count == 1 ? last->joined : last->filters;

    if (!filter || filter->kernels > 1 || filter->x.from != filter->x.to
        || filter->y.from != filter->y.to
        || (last->transposed && last->joined_count != 1 && !runs_whole(last, filter)))
        return false;
    bloom->rows = vkb_texel_kernel(&filter->x, (uint32_t)radius);
    bloom->columns = vkb_texel_kernel(&filter->y, (uint32_t)radius);
    bloom->gain = filter->gain;
    *from = filter == last->joined ? last->joined_from
                                   : last->reads[last->transposed ? SLOT_COTANGENTS : SLOT_SOURCE];
    return bloom->rows && bloom->columns;
}

// The bloom that the composite `pass` ends. `threshold_of` finds the threshold pass of a bloom
// buffer.
static bool find_bloom(const struct vkb_graph *graph, const struct vkb_pass_row *pass, int radius,
                       const struct vkb_pass_row *(*threshold_of)(const struct vkb_graph *graph,
                                                                  uint32_t image),
                       struct bloom *bloom)
{
    uint32_t glow;

    *bloom = (struct bloom){.last = vkb_bloom_of(graph, pass), .composite = pass};
    if (!bloom->last || !bloom->last->joined || bloom->last->filter_count != 1
        || !graph->images[pass->reads[SLOT_SCENE]].input
        || !vkb_is_written_once(graph, pass->reads[SLOT_BLOOM])
        || !find_kernels(bloom->last, radius, bloom, &glow))
        return false;
    bloom->threshold = threshold_of(graph, glow);
    return bloom->threshold && vkb_is_threshold(bloom->threshold)
        && bloom->threshold->reads[SLOT_SOURCE] == pass->reads[SLOT_SCENE];
}

VKB_COPY_FUNCTION(copy_composite, fused_bloom, composite,
                  COMPOSITE_ROWS(fused_bloom, VKB_COPY_READS, VKB_COPY_INPUT))
VKB_COPY_FUNCTION(copy_threshold, fused_bloom, threshold,
                  THRESHOLD_ROWS(fused_bloom, VKB_COPY_READS))

static struct vkb_pass_row fused_row(const struct vkb_variant_choice *choice,
                                     const struct bloom *bloom)
{
    const struct vkb_graph *graph = &choice->plain;
    const enum vkb_format format = graph->images[bloom->last->targets[0]].format;
    struct vkb_pass_row row;
    struct vkb_fused_bloom_params *params = &row.params.fused_bloom;

    memcpy(&row, bloom->composite, sizeof row);
    memset(&row.params, 0, sizeof row.params);
    vkb_read_only(&row, bloom->composite->reads[SLOT_SCENE]);
    if (row.transposed)
        vkb_read_at(&row, SLOT_ENDED, bloom->composite->reads[SLOT_COTANGENTS]);
    row.fused = true;
    row.block = VKB_BLOCK_fused_bloom;
    copy_composite(params, &bloom->composite->params.composite);
    if (bloom->threshold) {
        copy_threshold(params, &bloom->threshold->params.threshold);
        row.constants.threshold_mode = bloom->threshold->constants.threshold_mode;
    }
    row.constants.format = vkb_storage_mode(format);
    // The gain is that of the second pass, along rows.
    vkb_fill_weights(bloom->columns, 1.0, params->vertical);
    vkb_fill_weights(bloom->rows, bloom->gain, params->horizontal);
    return row;
}

// The columns of an invocation, at most STRIP_COLUMNS and a multiple of the pixels of two words of
// any format, so that the invocations of a row share it as evenly as possible.
static uint32_t strip_columns(uint32_t width)
{
    const uint32_t most = ROW_INVOCATIONS * STRIP_COLUMNS;
    const uint32_t invocations = ROW_INVOCATIONS * ((width + most - 1) / most);

    return ((width + invocations - 1) / invocations + 7) / 8 * 8;
}

static void make_strips(const struct vkb_variant_choice *choice, struct vkb_pass_row *row,
                        const struct vkb_shader *shader)
{
    const struct vkb_image_row *target = &choice->plain.images[row->targets[0]];
    const uint32_t columns = strip_columns(target->width);

    row->params.fused_bloom.columns = (int32_t)columns;
    row->gains_if_finite = true;
    vkb_make_linear(row, shader, columns, STRIP_ROWS);
}

// For kernels of up to TILE_RADIUS in three steps.
static void make_tiles(struct vkb_pass_row *row, const struct vkb_shader *shader,
                       const struct bloom *bloom)
{
    const uint32_t rows = bloom->rows->count, columns = bloom->columns->count;
    const int longest = (int)(rows > columns ? rows : columns) - 1;
    int radius = TILE_RADIUS / 4;

    while (radius < longest)
        radius *= 2;
    vkb_make_dispatch(row, shader, (uint32_t)(TILE_LOADED - 2 * radius), TILE_ROWS);
    row->constants.radius = radius;
    row->gains_if_finite = true;
}

// Adds the composite, and after it the fused pass in strips or in tiles, which may replace it.
bool vkb_add_fused_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    const bool gpu = choice->variants == VKB_VARIANTS_GPU;
    const enum vkb_format format = choice->plain.images[pass->targets[0]].format;
    struct bloom bloom;

    if (!(find_bloom(&choice->plain, pass, gpu ? TILE_RADIUS : STRIP_RADIUS,
                     gpu && pass->transposed ? vkb_graph_writer : vkb_threshold_of, &bloom)
          && (gpu
              || (vkb_fits_linear(choice, pass)
                  && (!pass->transposed || vkb_are_floats(choice, pass))))))
        return false;
    struct vkb_pass_row row = fused_row(choice, &bloom);
    if (gpu)
        make_tiles(&row, pass->transposed ? &vkb_shader_tile_mixed_comp : &vkb_shader_tile_comp,
                   &bloom);
    else
        make_strips(choice, &row,
                    pass->transposed ? &vkb_shader_strip_mixed_linear_rgba32float
                                     : strip_shaders[format]);
    return vkb_add_fullscreen_variant(choice, pass) && vkb_add_variant_pass(choice, &row);
}

// Whether the transpose adds nothing else to its result.
static bool is_alone(const struct vkb_pass_row *pass)
{
    return !pass->constants.adds_image && !pass->constants.masked;
}

// The transposes of a bloom, of which `pass` is the last one: that of the threshold, or of the
// filter, if there is no threshold. Its composite is a factor. The cotangents of the scene are an
// image, or left to the last pass. Or `pass` is that of the filter alone, whose result others read,
// too: sums and masks.
static bool find_adjoint_bloom(const struct vkb_graph *graph, const struct vkb_pass_row *pass,
                               int radius, struct bloom *bloom)
{
    const bool thresholds = vkb_transposes(pass, VKB_BLOCK_threshold)
                         && pass->constants.by == BY_SCENE
                         && pass->constants.sampling == SAMPLING_TEXEL && !pass->constants.masked
                         && !pass->constants.alpha;
    const uint32_t added = pass->reads[SLOT_ADDED], image = pass->reads[SLOT_DIFFERENTIATED];
    const bool ends = pass->constants.of_source && pass->constants.adds_image;
    uint32_t by_bloom;

    if (!((thresholds && ends)
          || (pass->block == VKB_BLOCK_adjoint_filter
              && (ends || (is_alone(pass) && !pass->constants.of_source)))))
        return false;
    *bloom = (struct bloom){
        .last = thresholds ? vkb_graph_writer(graph, pass->reads[SLOT_COTANGENTS]) : pass,
        .threshold = thresholds ? pass : NULL,
    };
    if (!bloom->last || bloom->last->block != VKB_BLOCK_adjoint_filter
        || (thresholds && !is_alone(bloom->last))
        || !find_kernels(bloom->last, radius, bloom, &by_bloom))
        return false;
    const struct vkb_pass_row *by_scene = vkb_graph_writer(graph, added);
    bloom->composite = vkb_graph_writer(graph, by_bloom);
    if (!bloom->composite || !vkb_is_factor(bloom->composite) || bloom->composite->constants.masked)
        return false;
    return !ends
        || (bloom->composite->reads[SLOT_SCENE] == image
            && (added == bloom->composite->reads[SLOT_COTANGENTS]
                || (by_scene && vkb_transposes(by_scene, VKB_BLOCK_composite) && is_alone(by_scene)
                    && by_scene->constants.by == BY_SCENE)));
}

// A fused row of the derivatives by the image or the glow, which replaces the composite's passes,
// the blurs' and the threshold's. It reads the image and the composite's cotangents. Nothing is
// rounded between the passes, whatever the formats are.
static struct vkb_pass_row adjoint_row(const struct vkb_variant_choice *choice,
                                       const struct vkb_pass_row *pass, const struct bloom *bloom)
{
    struct vkb_pass_row row = fused_row(choice, bloom);

    memcpy(row.name, pass->name, sizeof row.name);
    vkb_read_only(&row, bloom->composite->reads[SLOT_COTANGENTS]);
    vkb_read_at(&row, SLOT_ENDED, bloom->composite->reads[SLOT_SCENE]);
    row.targets[0] = pass->targets[0];
    row.constants.format = STORED_SINGLE;
    row.constants.adds_image = pass->constants.adds_image;
    // Its sums have another order, so it is taken always: all runs have the same bits.
    row.fused = false;
    row.gains_if_finite = true;
    return row;
}

bool vkb_add_adjoint_fused_variant(struct vkb_variant_choice *choice,
                                   const struct vkb_pass_row *pass)
{
    const bool gpu = choice->variants == VKB_VARIANTS_GPU;
    struct bloom bloom;

    if (!(find_adjoint_bloom(&choice->plain, pass, gpu ? TILE_RADIUS : STRIP_RADIUS, &bloom)
          && (gpu || vkb_are_floats(choice, bloom.composite))))
        return false;
    struct vkb_pass_row row = adjoint_row(choice, pass, &bloom);
    if (gpu)
        make_tiles(&row, &vkb_shader_tile_transposed_comp, &bloom);
    else
        make_strips(choice, &row, &vkb_shader_strip_transposed_linear_rgba32float);
    return vkb_add_variant_pass(choice, &row);
}
