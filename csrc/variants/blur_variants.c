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
    const bool vertical = blur->constants.direction == DIRECTION_VERTICAL;
    const int radius = blur->constants.radius;
    struct vkb_pass_row row;

    memcpy(&row, blur, sizeof row);
    row.constants = (struct vkb_constants){.alpha = blur->constants.alpha};
    memset(&row.params, 0, sizeof row.params);
    vkb_make_dispatch(&row, line_shaders[graph->images[blur->reads[SLOT_SOURCE]].format],
                      vertical ? ROW_INVOCATIONS : ROW_INVOCATIONS * LINE_OUTPUTS,
                      vertical ? LINE_OUTPUTS : 1);
    row.reading = VKB_READING_LOADED;
    row.targets[0] = target;
    row.constants.unrolled_radius = radius <= LINE_SHORT_RADIUS ? radius : 0;
    row.constants.rolled = choice->variants == VKB_VARIANTS_CPU && row.constants.unrolled_radius > 0
                        && (uint64_t)image->width * image->height <= ROLLED_PIXELS;
    if (!row.constants.rolled) {
        row.constants.direction = blur->constants.direction;
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
        row.params.line.kernel[tap / 4][tap % 4] =
            blur->params.blur.weights[weight / 4][weight % 4];
    }
    return row;
}

static bool add_line_row(struct vkb_variant_choice *choice, const struct vkb_pass_row *row)
{
    vkb_add_variant(choice, row);
    if (row->params.line.levels && !choice->failed)
        choice->graph->passes[choice->graph->pass_count - 1].constants.stored = STORED_SINGLE;
    return true;
}

// Adds a line blur if the source has the target's size.
bool vkb_add_line(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    if (!((vkb_is_line(pass, DIRECTION_VERTICAL, LINE_RADIUS)
           || vkb_is_line(pass, DIRECTION_HORIZONTAL, LINE_RADIUS))
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
    if (!vkb_is_line(pass, DIRECTION_HORIZONTAL, LINE_RADIUS))
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

bool vkb_add_enlarged(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
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
    const uint32_t lines = vkb_add_floats(choice, name, size);
    struct vkb_pass_row line = line_row(choice, pass, lines, -1);
    struct vkb_pass_row row =
        vkb_fullscreen_row(pass->name, &vkb_shader_enlarge_frag, pass->targets[0]);
    row.constants.sampling = unorm ? SAMPLING_FILTER : SAMPLING_FETCH;
    row.constants.alpha = pass->constants.alpha;
    vkb_read_only(&row, lines);
    row.block = VKB_BLOCK_threshold;
    // Not of `plain`: a new image may have moved these.
    VKB_SET_TARGET(&row, threshold, &choice->graph->images[pass->targets[0]]);
    return add_line_row(choice, &line) && vkb_add_fullscreen(choice, &row);
}

// A composite of two lines of a threshold, all at the size of the image.
struct nest {
    const struct vkb_pass_row *threshold, *vertical, *horizontal, *composite;
};

// The only pass that writes the image, if it is such a line; else NULL.
static const struct vkb_pass_row *line_of(const struct vkb_graph *graph, uint32_t image,
                                          enum vkb_mode direction, int radius)
{
    const struct vkb_pass_row *pass = vkb_writer_of(graph, image);

    return pass && vkb_is_line(pass, direction, radius) && vkb_is_written_once(graph, image)
                && vkb_same_size(graph, pass->reads[SLOT_SOURCE], image)
             ? pass
             : NULL;
}

// `threshold_of` finds the threshold pass of a bloom buffer.
static bool find_nest(const struct vkb_graph *graph, const struct vkb_pass_row *pass, int radius,
                      const struct vkb_pass_row *(*threshold_of)(const struct vkb_graph *graph,
                                                                 uint32_t image),
                      struct nest *nest)
{
    *nest = (struct nest){.composite = pass};
    if (!vkb_ends_bloom(pass) || !graph->images[pass->reads[SLOT_SOURCE]].input)
        return false;
    nest->horizontal = line_of(graph, pass->reads[SLOT_BLOOM], DIRECTION_HORIZONTAL, radius);
    if (nest->horizontal)
        nest->vertical =
            line_of(graph, nest->horizontal->reads[SLOT_SOURCE], DIRECTION_VERTICAL, radius);
    if (nest->vertical)
        nest->threshold = threshold_of(graph, nest->vertical->reads[SLOT_SOURCE]);
    return nest->threshold && vkb_is_threshold(nest->threshold)
        && nest->threshold->reads[SLOT_SOURCE] == pass->reads[SLOT_SOURCE];
}

VKB_COPY_FUNCTION(copy_composite, fused_bloom, composite,
                  COMPOSITE_ROWS(fused_bloom, VKB_COPY_READS, VKB_COPY_INPUT))
VKB_COPY_FUNCTION(copy_threshold, fused_bloom, threshold,
                  THRESHOLD_ROWS(fused_bloom, VKB_COPY_READS))

static struct vkb_pass_row fused_row(const struct vkb_variant_choice *choice,
                                     const struct nest *nest)
{
    const struct vkb_graph *graph = &choice->plain;
    const enum vkb_format format = graph->images[nest->horizontal->targets[0]].format;
    struct vkb_pass_row row;
    struct vkb_fused_bloom_params *params = &row.params.fused_bloom;

    memcpy(&row, nest->composite, sizeof row);
    memset(&row.params, 0, sizeof row.params);
    vkb_read_only(&row, nest->composite->reads[SLOT_SCENE]);
    if (row.transposed)
        vkb_read_at(&row, SLOT_ENDED, nest->composite->reads[SLOT_COTANGENTS]);
    row.fused = true;
    row.block = VKB_BLOCK_fused_bloom;
    copy_composite(params, &nest->composite->params.composite);
    copy_threshold(params, &nest->threshold->params.threshold);
    row.constants.threshold_mode = nest->threshold->constants.threshold_mode;
    row.constants.format = vkb_storage_mode(format);
    memcpy(params->vertical, nest->vertical->params.blur.weights, sizeof params->vertical);
    memcpy(params->horizontal, nest->horizontal->params.blur.weights, sizeof params->horizontal);
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
    const uint32_t rows = STRIP_ROWS(vkb_formats[target->format].channel_size);
    const uint32_t columns = strip_columns(target->width);

    row->params.fused_bloom.columns = (int32_t)columns;
    row->gains_if_finite = true;
    vkb_make_linear(row, shader, columns, rows);
}

// For kernels of up to TILE_RADIUS in three steps.
static void make_tiles(struct vkb_pass_row *row, const struct vkb_shader *shader,
                       const struct nest *nest)
{
    int radius = TILE_RADIUS / 4;

    while (radius < nest->vertical->constants.radius || radius < nest->horizontal->constants.radius)
        radius *= 2;
    vkb_make_dispatch(row, shader, (uint32_t)(TILE_LOADED - 2 * radius), TILE_ROWS);
    row->constants.radius = radius;
    row->gains_if_finite = true;
}

// Adds the composite, and after it the fused pass in strips or in tiles, which may replace it.
bool vkb_add_fused(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    const bool gpu = choice->variants == VKB_VARIANTS_GPU;
    const enum vkb_format format = choice->plain.images[pass->targets[0]].format;
    struct nest nest;

    if (!(find_nest(&choice->plain, pass, gpu ? TILE_RADIUS : STRIP_RADIUS,
                    gpu && pass->transposed ? vkb_writer_of : vkb_threshold_of, &nest)
          && (gpu
              || (vkb_fits_linear(choice, pass)
                  && (!pass->transposed || vkb_are_floats(choice, pass))))))
        return false;
    struct vkb_pass_row row = fused_row(choice, &nest);
    if (gpu)
        make_tiles(&row, pass->transposed ? &vkb_shader_tile_mixed_comp : &vkb_shader_tile_comp,
                   &nest);
    else
        make_strips(choice, &row,
                    pass->transposed ? &vkb_shader_strip_mixed_linear_rgba32float
                                     : strip_shaders[format]);
    return vkb_add_fullscreen(choice, pass) && vkb_add_variant(choice, &row);
}

// The pass that writes the cotangents of an image, if it has this block and nothing else adds
// any; else NULL.
static const struct vkb_pass_row *sole_adjoint(const struct vkb_graph *graph, uint32_t image,
                                               enum vkb_block block)
{
    const struct vkb_pass_row *pass = vkb_writer_of(graph, image);

    return pass && vkb_transposes(pass, block) && !pass->constants.add_own
                && !pass->constants.masked
             ? pass
             : NULL;
}

// The graph's nest. The formats of image and bloom may differ.
static bool find_any_nest(const struct vkb_graph *graph, int radius, struct nest *nest)
{
    for (uint32_t i = 0; i < graph->pass_count; ++i)
        if (find_nest(graph, &graph->passes[i], radius, vkb_writer_of, nest))
            return true;
    return false;
}

// The transposes of a nest, of which `pass` is the last one: that of the threshold, or of the
// vertical blur, if there is no threshold. The nest's composite is its adjoint then, a factor.
// The cotangents of the scene are an image, or left to the last pass.
static bool find_adjoint_nest(const struct vkb_graph *graph, const struct vkb_pass_row *pass,
                              int radius, struct nest *nest)
{
    const enum vkb_block filter = VKB_BLOCK_adjoint_filter, composite = VKB_BLOCK_composite;
    const bool thresholds = vkb_transposes(pass, VKB_BLOCK_threshold)
                         && pass->constants.by == BY_SCENE && !pass->constants.masked;

    if (!(thresholds || (pass->block == filter && pass->constants.of_source))
        || !pass->constants.add_own || !find_any_nest(graph, radius, nest))
        return false;
    const struct vkb_pass_row *first =
        thresholds ? sole_adjoint(graph, pass->reads[SLOT_COTANGENTS], filter) : pass;
    const struct vkb_pass_row *second =
        first ? sole_adjoint(graph, first->reads[SLOT_COTANGENTS], filter) : NULL;
    const uint32_t added = pass->reads[SLOT_ADDED];
    const struct vkb_pass_row *by_scene = sole_adjoint(graph, added, composite);
    nest->composite = second ? vkb_writer_of(graph, second->reads[SLOT_COTANGENTS]) : NULL;
    return nest->composite && vkb_is_factor(nest->composite)
        && (added == nest->composite->reads[SLOT_COTANGENTS]
            || (by_scene && by_scene->constants.by == BY_SCENE))
        && nest->threshold->reads[SLOT_SOURCE] == pass->reads[SLOT_DIFFERENTIATED];
}

// A fused row of the derivatives by the image, which replaces the composite's passes, the blurs'
// and the threshold's. It reads the image and the composite's cotangents. Nothing is rounded
// between the passes, whatever the formats are.
static struct vkb_pass_row adjoint_row(const struct vkb_variant_choice *choice,
                                       const struct vkb_pass_row *pass, const struct nest *nest)
{
    struct vkb_pass_row row = fused_row(choice, nest);

    memcpy(row.name, pass->name, sizeof row.name);
    vkb_read_only(&row, nest->composite->reads[SLOT_COTANGENTS]);
    vkb_read_at(&row, SLOT_ENDED, nest->composite->reads[SLOT_SCENE]);
    row.targets[0] = pass->targets[0];
    row.constants.format = STORED_SINGLE;
    // Its sums have another order, so it is taken always: all runs have the same bits.
    row.fused = false;
    row.gains_if_finite = true;
    return row;
}

bool vkb_add_adjoint_fused(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    const bool gpu = choice->variants == VKB_VARIANTS_GPU;
    struct nest nest;

    if (!(find_adjoint_nest(&choice->plain, pass, gpu ? TILE_RADIUS : STRIP_RADIUS, &nest)
          && (gpu || vkb_are_floats(choice, nest.composite))))
        return false;
    struct vkb_pass_row row = adjoint_row(choice, pass, &nest);
    if (gpu)
        make_tiles(&row, &vkb_shader_tile_transposed_comp, &nest);
    else
        make_strips(choice, &row, &vkb_shader_strip_transposed_linear_rgba32float);
    return vkb_add_variant(choice, &row);
}
