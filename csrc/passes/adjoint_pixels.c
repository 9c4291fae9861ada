// The adjoints of passes that compute each pixel from those at the same place: the composite, and
// the threshold pass, which reduces the image before.
#include "passes/adjoint.h"

#include <math.h>

// Whether the derivatives by images depend on the bloom. Otherwise it need not be rendered for
// them.
static bool depends_on_bloom(const struct vkb_pass_row *row)
{
    const struct vkb_constants *constants = &row->constants;

    return constants->composite == COMPOSITE_SCREEN || constants->composite == COMPOSITE_SOFT_LIGHT
        || constants->composite == COMPOSITE_UNCLAMPED_SCREEN
        || constants->composite == COMPOSITE_LIGHTNESS_SCREEN || constants->tonemap != TONEMAP_NONE
        || constants->encoding != ENCODING_NONE || constants->alpha != ALPHA_KEEP
        || row->params.composite.limit < (float)SINGLE_LIMIT;
}

bool vkb_adds_bloom(const struct vkb_pass_row *composite)
{
    return composite->constants.composite == COMPOSITE_ADD && !depends_on_bloom(composite)
        && !composite->constants.lit;
}

// Whether the derivatives by the scene are a share of all colours, or of those that are positive. A
// pass that takes these has a source's image at hand.
static bool scales_scene(const struct vkb_graph *graph, const struct vkb_pass_row *row)
{
    const int32_t composite = row->constants.composite;

    return !depends_on_bloom(row)
        && (composite == COMPOSITE_ADD || composite == COMPOSITE_MIX
            || (composite == COMPOSITE_ADD_TO_POSITIVE
                && vkb_is_of_source(&graph->images[row->reads[SLOT_SCENE]])));
}

static struct vkb_share share_of_scene(const struct vkb_pass_row *row)
{
    const struct vkb_composite_params *params = &row->params.composite;
    const double exposed = exp2(params->exposure);
    const double lost = row->constants.composite == COMPOSITE_MIX ? exposed * params->intensity : 0;

    return (struct vkb_share){
        .factor = row->constants.masked ? exposed : exposed - lost,
        .by_mask = row->constants.masked ? lost : 0.0,
        .of_positive = row->constants.composite == COMPOSITE_ADD_TO_POSITIVE,
    };
}

// By scene, bloom and mask, with the row of a shader that reads these and the cotangents.
static bool accumulate_composite(struct vkb_adjoint *adjoint, struct vkb_pass_row *row,
                                 struct vkb_error *error)
{
    const struct vkb_constants *constants = &row->constants;
    const uint32_t images[] = {
        [BY_SCENE] = row->reads[SLOT_SCENE],
        [BY_BLOOM] = row->reads[SLOT_BLOOM],
        [BY_MASK] = row->reads[SLOT_MASK],
    };

    if (!depends_on_bloom(row))
        row->reads[SLOT_BLOOM] = VKB_NO_IMAGE;
    for (enum vkb_mode by = BY_SCENE; by <= BY_MASK; ++by) {
        row->constants.by = by;
        if ((by == BY_BLOOM && constants->composite == COMPOSITE_OFF)
            || (by == BY_MASK && !constants->masked))
            continue;
        if (by == BY_SCENE && scales_scene(adjoint->graph, row)
            && adjoint->cotangents[images[by]] == VKB_NO_IMAGE)
            vkb_delay_scene(adjoint, row, share_of_scene(row), images[by]);
        else if (!vkb_accumulate_cotangent(adjoint, row, images[by], error))
            return false;
    }
    return true;
}

// Whether a clamp keeps the bloom at 0 or above.
static bool is_clamped(const struct vkb_graph *graph)
{
    for (uint32_t i = 0; i < graph->pass_count; ++i)
        if (graph->passes[i].constants.clamped)
            return true;
    return false;
}

// Whether a threshold multiplies the alpha of the bloom by a factor, which is 0 up to a kink.
static bool is_thresholded(const struct vkb_graph *graph)
{
    for (uint32_t i = 0; i < graph->pass_count; ++i)
        if (graph->passes[i].constants.thresholded
            || graph->passes[i].constants.threshold_mode != THRESHOLD_NONE)
            return true;
    return false;
}

// Whether the picture before exposure and curves is a share of the scene and one of the bloom.
static bool is_sum(const struct vkb_constants *constants)
{
    return (constants->composite == COMPOSITE_ADD || constants->composite == COMPOSITE_MIX)
        && constants->alpha == ALPHA_KEEP && !constants->masked && !constants->exposed_scene
        && !constants->clamped;
}

// Adds the cotangents of the picture before exposure and curves, and makes `row` that of a
// composite without these.
static bool add_curves(struct vkb_adjoint *adjoint, struct vkb_pass_row *row,
                       struct vkb_error *error)
{
    struct vkb_pass_row curves = *row;

    curves.constants.by = BY_MIXED;
    row->constants.tonemap = TONEMAP_NONE;
    row->constants.encoding = ENCODING_NONE;
    row->params.composite.exposure = 0.0f;
    row->params.composite.limit = (float)SINGLE_LIMIT;
    return vkb_add_adjoint_image(adjoint, &curves,
                                 vkb_size_of(adjoint->graph, row->reads[SLOT_SCENE]),
                                 &row->reads[SLOT_COTANGENTS], error);
}

bool vkb_transpose_composite(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                             struct vkb_error *error)
{
    struct vkb_pass_row row = vkb_slope_row(adjoint, pass, &vkb_shader_adjoint_composite_frag);

    row.reads[SLOT_BLOOM] = pass->reads[SLOT_BLOOM];
    row.constants.clamped = is_clamped(adjoint->graph);
    row.constants.thresholded = row.constants.alpha == ALPHA_BLUR && is_thresholded(adjoint->graph);
    if ((adjoint->sums.composite
         && !vkb_add_sum_passes(adjoint, &row, &vkb_shader_adjoint_composite_sums_frag,
                                vkb_size_of(adjoint->graph, pass->targets[0]), ".by_composite",
                                error))
        || (is_sum(&row.constants) && depends_on_bloom(&row) && !add_curves(adjoint, &row, error)))
        return false;
    return accumulate_composite(adjoint, &row, error);
}

bool vkb_transpose_blender_end(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                               struct vkb_error *error)
{
    const struct vkb_blender_end_params *params = &pass->params.blender_end;
    const uint32_t source = pass->reads[SLOT_SOURCE], target = pass->targets[0];
    const struct vkb_pass_row row =
        vkb_slope_row(adjoint, pass, &vkb_shader_adjoint_blender_end_frag);
    struct vkb_filter filter;

    vkb_filter_begin(adjoint->graph, source, target, &filter);
    if (params->reads_next)
        vkb_filter_next(&filter, params->next[0]);
    return vkb_accumulate_through(adjoint, &row, &filter, source, target, error);
}

bool vkb_transpose_threshold(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                             struct vkb_error *error)
{
    const uint32_t target = pass->targets[0];
    struct vkb_pass_row row = vkb_slope_row(adjoint, pass, &vkb_shader_adjoint_threshold_frag);

    if (adjoint->sums.threshold && pass->constants.threshold_mode == THRESHOLD_KNEE
        && !vkb_add_sum_passes(adjoint, &row, &vkb_shader_adjoint_threshold_sums_frag,
                               vkb_size_of(adjoint->graph, target),
                               adjoint->light ? ".by_light" : ".by_threshold", error))
        return false;
    row.constants.by = BY_SCENE;
    return vkb_accumulate_sampled(adjoint, &row, pass->reads[SLOT_SOURCE], target, error)
        && vkb_accumulate_mask(adjoint, pass, &row, error);
}
