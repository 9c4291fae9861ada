#include "variants/variant.h"

#include <string.h>

static const char *const variant_names[VKB_VARIANTS_COUNT] = {
    [VKB_VARIANTS_FRAGMENT] = "fragment",
    [VKB_VARIANTS_CPU] = "cpu",
    [VKB_VARIANTS_GPU] = "gpu",
};

struct variant {
    enum vkb_column variants;
    const char *name;
    vkb_variant_add *add;
    uint32_t least_pixels;  // of the target
};

// A filter as two passes instead of one is slow in small images, since each pass takes time to
// start. Tiles are slow in images that leave a GPU idle: with 8,040 pixels a level takes 0.016 ms,
// as pixels 0.008; with 32,400 it takes 0.011 and 0.015 (H100, 2026-11-27).
enum { TWO_PASSES = 1 << 12, TILES = 1 << 14 };

static const struct variant variants_table[] = {
    {VKB_VARIANTS_CPU, "line", vkb_add_line_variant, 0},
    {VKB_VARIANTS_CPU, "enlarged", vkb_add_enlarged_variant, 0},
    {VKB_VARIANTS_CPU, "strips", vkb_add_fused_variant, 0},
    {VKB_VARIANTS_CPU, "strips", vkb_add_windowed_variant, 0},
    {VKB_VARIANTS_CPU, "line", vkb_add_nine_variant, 0},
    {VKB_VARIANTS_CPU, "filtered", vkb_add_filtered_variant, 0},
    {VKB_VARIANTS_CPU, "filtered_final", vkb_add_filtered_final_variant, 0},
    {VKB_VARIANTS_CPU, "gathered", vkb_add_gathered_variant, TWO_PASSES},
    {VKB_VARIANTS_CPU, "strips", vkb_add_streaks_variant, 0},
    {VKB_VARIANTS_CPU, "host", vkb_add_host_beams_variant, 0},
    {VKB_VARIANTS_CPU, "host", vkb_add_host_transform_variant, 0},
    {VKB_VARIANTS_CPU, "host", vkb_add_host_ghosts_variant, 0},
    {VKB_VARIANTS_CPU, "strips", vkb_add_adjoint_fused_variant, 0},
    {VKB_VARIANTS_CPU, "linear", vkb_add_adjoint_linear_variant, 0},
    {VKB_VARIANTS_CPU, "pixels", vkb_add_adjoint_first_variant, 0},
    {VKB_VARIANTS_CPU, "pixels", vkb_add_adjoint_end_variant, 0},
    {VKB_VARIANTS_CPU, "pixels", vkb_add_pixels_variant, 0},
    {VKB_VARIANTS_GPU, "pixels", vkb_add_windowed_variant, 0},
    {VKB_VARIANTS_GPU, "enlarged", vkb_add_enlarged_variant, 0},
    {VKB_VARIANTS_GPU, "tiles", vkb_add_fused_variant, 0},
    {VKB_VARIANTS_GPU, "tiles", vkb_add_adjoint_fused_variant, 0},
    {VKB_VARIANTS_GPU, "tiles", vkb_add_adjoint_filter_variant, 0},
    {VKB_VARIANTS_GPU, "pixels", vkb_add_adjoint_first_variant, 0},
    {VKB_VARIANTS_GPU, "pixels", vkb_add_adjoint_end_variant, 0},
    {VKB_VARIANTS_GPU, "line", vkb_add_line_variant, 0},
    {VKB_VARIANTS_GPU, "lines", vkb_add_transform_lines_variant, 0},
    {VKB_VARIANTS_GPU, "tiles", vkb_add_filtered_variant, TILES},
    {VKB_VARIANTS_GPU, "tiles_final", vkb_add_filtered_final_variant, 0},
    {VKB_VARIANTS_GPU, "pixels", vkb_add_pixels_variant, 0},
};

// Whether the first `length` characters of a text are this name.
static bool is_name(const char *text, size_t length, const char *name)
{
    return strlen(name) == length && strncmp(text, name, length) == 0;
}

// The bits of the rows that the names behind a column leave out: "-filtered-strips".
static bool read_without(const char *names, struct vkb_variants *variants, struct vkb_error *error)
{
    const size_t rows = sizeof variants_table / sizeof variants_table[0];

    _Static_assert(sizeof variants_table / sizeof variants_table[0] <= 32, "a bit for each row");
    while (*names != '\0') {
        const char *name = names + 1;
        const size_t length = strcspn(name, "-");
        uint32_t found = 0;
        for (size_t i = 0; i < rows; ++i)
            if (variants_table[i].variants == variants->column
                && is_name(name, length, variants_table[i].name))
                found |= UINT32_C(1) << i;
        if (found == 0)
            return vkb_fail(error, VKB_ERROR_VALUE, "VKBLOOM_VARIANT: %s has no variant %.*s",
                            variant_names[variants->column], (int)length, name);
        variants->without |= found;
        names = name + length;
    }
    return true;
}

bool vkb_variants_by_name(const char *name, const struct vkb_device *device,
                          struct vkb_variants *variants, struct vkb_error *error)
{
    const size_t length = strcspn(name, "-");
    int found = 0;

    if (is_name(name, length, "auto"))
        found = !device->dispatch                                          ? VKB_VARIANTS_FRAGMENT
              : device->adapter.device_type == VK_PHYSICAL_DEVICE_TYPE_CPU ? VKB_VARIANTS_CPU
                                                                           : VKB_VARIANTS_GPU;
    else
        while (found < VKB_VARIANTS_COUNT && !is_name(name, length, variant_names[found]))
            ++found;
    if (found == VKB_VARIANTS_COUNT)
        return vkb_fail(error, VKB_ERROR_VALUE,
                        "VKBLOOM_VARIANT: %s is not one of auto, fragment, cpu, gpu", name);
    if (found != VKB_VARIANTS_FRAGMENT && !device->dispatch)
        return vkb_fail(error, VKB_ERROR_VALUE,
                        "VKBLOOM_VARIANT: the compute shaders of %s cannot write images, which %s "
                        "needs; use auto or fragment",
                        device->adapter.name, name);
    *variants = (struct vkb_variants){.column = (enum vkb_column)found};
    return read_without(name + length, variants, error);
}

// Names the rows from `first` on after the table's variant. A row before a fused pass is the
// method's own pass, unless it goes on in place.
static void name_variant(struct vkb_graph *graph, uint32_t first, const char *name)
{
    for (uint32_t i = first; i < graph->pass_count; ++i) {
        struct vkb_pass_row *pass = &graph->passes[i];
        const bool own =
            i + 1 < graph->pass_count && pass[1].fused && !pass->fused && !vkb_pass_in_place(pass);
        pass->variant = !own ? name : pass->geometry == VKB_GEOMETRY_DISPATCH ? "pixels" : NULL;
    }
}

static void add_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                        uint32_t without)
{
    const struct vkb_image_row *target = &choice->plain.images[pass->targets[0]];
    const uint64_t pixels = (uint64_t)target->width * target->height;

    for (size_t i = 0; i < sizeof variants_table / sizeof variants_table[0]; ++i) {
        const uint32_t first = choice->graph->pass_count;
        if (variants_table[i].variants != choice->variants || (without >> i & 1) != 0
            || pixels < variants_table[i].least_pixels || !variants_table[i].add(choice, pass))
            continue;
        name_variant(choice->graph, first, variants_table[i].name);
        return;
    }
    vkb_add_variant_pass(choice, pass);
}

bool vkb_variants_choose(struct vkb_variants variants, const struct vkb_device *device,
                         struct vkb_graph *graph, struct vkb_error *error)
{
    struct vkb_variant_choice choice = {
        .variants = variants.column,
        .device = device,
        .plain = *graph,
        .graph = graph,
        .error = error,
    };

    if (variants.column == VKB_VARIANTS_FRAGMENT)
        return true;
    // The graph keeps its images and gets new passes.
    graph->passes = NULL;
    graph->pass_count = 0;
    graph->pass_capacity = 0;
    for (uint32_t i = 0; !choice.failed && i < choice.plain.pass_count; ++i) {
        // Adding an image may move the array.
        choice.plain.images = graph->images;
        add_variant(&choice, &choice.plain.passes[i], variants.without);
    }
    vkb_free(choice.plain.passes);
    return !choice.failed;
}
