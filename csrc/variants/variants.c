#include "variants/variant.h"

#include <string.h>

static const char *const variant_names[VKB_VARIANTS_COUNT] = {
    [VKB_VARIANTS_FRAGMENT] = "fragment",
    [VKB_VARIANTS_CPU] = "cpu",
    [VKB_VARIANTS_GPU] = "gpu",
};

bool vkb_variants_by_name(const char *name, const struct vkb_device *device,
                          enum vkb_variants *variants, struct vkb_error *error)
{
    int found = 0;

    if (strcmp(name, "auto") == 0)
        found = !device->dispatch                                          ? VKB_VARIANTS_FRAGMENT
              : device->adapter.device_type == VK_PHYSICAL_DEVICE_TYPE_CPU ? VKB_VARIANTS_CPU
                                                                           : VKB_VARIANTS_GPU;
    else
        while (found < VKB_VARIANTS_COUNT && strcmp(variant_names[found], name) != 0)
            ++found;
    if (found == VKB_VARIANTS_COUNT)
        return vkb_fail(error, VKB_ERROR_VALUE,
                        "VKBLOOM_FORM: %s is not one of auto, fragment, cpu, gpu", name);
    if (found != VKB_VARIANTS_FRAGMENT && !device->dispatch)
        return vkb_fail(error, VKB_ERROR_VALUE,
                        "VKBLOOM_FORM: the compute shaders of %s cannot write images, which %s "
                        "needs; use auto or fragment",
                        device->adapter.name, name);
    *variants = (enum vkb_variants)found;
    return true;
}

enum vkb_mode vkb_stored_as(const struct vkb_device *device, enum vkb_format format)
{
    return format == VKB_FORMAT_RGBA8_UNORM
                && device->adapter.device_type == VK_PHYSICAL_DEVICE_TYPE_CPU
             ? STORED_UNORM8_SCALED
             : vkb_storage_mode(format);
}

bool vkb_has_format_of(const struct vkb_graph *graph, uint32_t a, uint32_t b)
{
    return vkb_formats[graph->images[a].format].vk == vkb_formats[graph->images[b].format].vk;
}

bool vkb_is_written_once(const struct vkb_graph *graph, uint32_t image)
{
    uint32_t writers = 0;

    for (uint32_t i = 0; i < graph->pass_count; ++i)
        for (uint32_t target = 0; target < graph->passes[i].target_count; ++target)
            writers += graph->passes[i].targets[target] == image;
    return writers == 1;
}

void vkb_drop_reads(struct vkb_pass_row *row, uint32_t read_count)
{
    while (row->read_count > read_count)
        row->reads[--row->read_count] = 0;
}

void vkb_make_dispatch(struct vkb_pass_row *row, const struct vkb_shader *shader,
                       uint32_t block_width, uint32_t block_height)
{
    row->geometry = VKB_GEOMETRY_DISPATCH;
    row->vertex = NULL;
    row->shader = shader;
    row->block_width = block_width;
    row->block_height = block_height;
}

void vkb_make_words(struct vkb_pass_row *row, const struct vkb_shader *shader, uint32_t columns,
                    uint32_t rows)
{
    vkb_make_dispatch(row, shader, ROW_INVOCATIONS * columns, rows);
    row->reading = VKB_READING_WORDS;
}

bool vkb_fits_words(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass)
{
    bool fits = choice->device->words;

    for (uint32_t i = 0; i < pass->read_count; ++i) {
        const struct vkb_image_row *row = &choice->graph->images[pass->reads[i]];
        fits = fits && vkb_image_fits_words(choice->device, row->format, row->width, row->height);
    }
    return fits;
}

const struct vkb_pass_row *vkb_writer_of(const struct vkb_graph *graph, uint32_t image)
{
    const struct vkb_pass_row *writer = NULL;

    for (uint32_t i = 0; i < graph->pass_count; ++i)
        if (graph->passes[i].target_count == 1 && graph->passes[i].targets[0] == image)
            writer = &graph->passes[i];
    return writer;
}

const struct vkb_pass_row *vkb_threshold_of(const struct vkb_graph *graph, uint32_t image)
{
    const struct vkb_pass_row *pass = vkb_writer_of(graph, image);

    return pass && vkb_is_threshold(pass)
                && graph->images[pass->reads[0]].format == graph->images[image].format
             ? pass
             : NULL;
}

static const struct vkb_shader *const blend_shaders[VKB_FORMAT_COUNT] = VKB_WORDS_BY_FORMAT(blend);
static const struct vkb_shader *const threshold_shaders[VKB_FORMAT_COUNT] =
    VKB_WORDS_BY_FORMAT(threshold);
static const struct vkb_shader *const kino_shaders[VKB_FORMAT_COUNT] =
    VKB_WORDS_BY_FORMAT(kino_bright);
static const struct vkb_shader *const highlights_shaders[VKB_FORMAT_COUNT] =
    VKB_WORDS_BY_FORMAT(highlights);
static const struct vkb_shader *const scale_shaders[VKB_FORMAT_COUNT] = VKB_WORDS_BY_FORMAT(scale);

// Whether the pass is a composite whose images have the same size and format.
static bool blends(const struct vkb_graph *graph, const struct vkb_pass_row *pass)
{
    return vkb_is_composite(pass) && pass->constants.bloom != BLOOM_LINES && !pass->constants.masked
        && vkb_same_size(graph, pass->reads[0], pass->targets[0])
        && vkb_same_size(graph, pass->reads[1], pass->targets[0])
        && vkb_has_format_of(graph, pass->reads[0], pass->reads[1])
        && vkb_has_format_of(graph, pass->reads[0], pass->targets[0]);
}

// Whether the pass is a threshold pass between images of the same format.
static bool loads_threshold(const struct vkb_graph *graph, const struct vkb_pass_row *pass)
{
    return vkb_is_threshold(pass) && vkb_has_format_of(graph, pass->reads[0], pass->targets[0]);
}

// The shaders for a pass from an image of the target's size and format; NULL: it is none of those
// that need no filter then.
static const struct vkb_shader *const *unfiltered_shaders(const struct vkb_graph *graph,
                                                          const struct vkb_pass_row *pass)
{
    if (pass->constants.masked || !vkb_same_size(graph, pass->reads[0], pass->targets[0])
        || !vkb_has_format_of(graph, pass->reads[0], pass->targets[0]))
        return NULL;
    return pass->shader == &vkb_shader_kino_prefilter_frag    ? kino_shaders
         : pass->shader == &vkb_shader_blender_prefilter_frag ? highlights_shaders
         : pass->shader == &vkb_shader_pyramid_up_frag && vkb_only_scales(graph, pass)
             ? scale_shaders
             : NULL;
}

// Turns a pass that reads only the pixel at its own position into one that loads it, from the first
// `read_count` images.
static void load_pixels(struct vkb_pass_row *row, const struct vkb_shader *shader,
                        enum vkb_format format, uint32_t read_count)
{
    vkb_make_words(row, shader, TEXEL_COLUMNS(vkb_formats[format].channel_size), TEXEL_ROWS);
    vkb_drop_reads(row, read_count);
}

bool vkb_add_fullscreen(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                        struct vkb_error *error)
{
    const struct vkb_graph *graph = choice->graph;
    const enum vkb_format format = graph->images[pass->reads[0]].format;
    const struct vkb_shader *const *unfiltered = unfiltered_shaders(graph, pass);
    struct vkb_pass_row row;

    memcpy(&row, pass, sizeof row);
    if (choice->variants == VKB_VARIANTS_GPU)
        vkb_make_dispatch(&row, pass->shader->dispatch, PIXEL_INVOCATIONS, PIXEL_INVOCATIONS);
    else if (vkb_fits_words(choice, pass) && blends(graph, pass))
        load_pixels(&row, blend_shaders[format], format, 2);
    else if (vkb_fits_words(choice, pass) && loads_threshold(graph, pass))
        load_pixels(&row, threshold_shaders[format], format, 1);
    else if (vkb_fits_words(choice, pass) && unfiltered)
        load_pixels(&row, unfiltered[format], format, 1);
    return vkb_graph_add_pass(choice->graph, &row, error);
}

static bool add_pixels(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                       bool *fits, struct vkb_error *error)
{
    *fits = pass->geometry == VKB_GEOMETRY_FULLSCREEN && pass->shader->dispatch
         && vkb_is_written_once(&choice->plain, pass->targets[0]);
    return !*fits || vkb_add_fullscreen(choice, pass, error);
}

static const struct vkb_shader *const fft_shaders[VKB_FORMAT_COUNT] = VKB_WORDS_BY_FORMAT(fft);
static const struct vkb_shader *const fft_stored_shaders[VKB_FORMAT_COUNT] =
    VKB_WORDS_BY_FORMAT(fft_stored);

// A storage buffer must reach the complete target: an invocation stores to places far apart.
static bool reaches(const struct vkb_device *device, const struct vkb_image_row *row)
{
    return (uint64_t)vkb_image_row_pitch(row->format, row->width) * row->height
        <= device->limits.maxStorageBufferRange;
}

static bool add_transform(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                          bool *fits, struct vkb_error *error)
{
    const struct vkb_image_row *from = &choice->graph->images[pass->reads[0]];
    const struct vkb_image_row *target = &choice->graph->images[pass->targets[0]];
    struct vkb_pass_row row;

    *fits = pass->block == VKB_BLOCK_fft && vkb_fits_words(choice, pass)
         && reaches(choice->device, target);
    if (!*fits)
        return true;
    memcpy(&row, pass, sizeof row);
    row.reading = VKB_READING_WORDS;
    row.shader = pass->constants.stage == STAGE_LAST ? fft_stored_shaders[target->format]
                                                     : fft_shaders[from->format];
    return vkb_graph_add_pass(choice->graph, &row, error);
}

struct variant {
    enum vkb_variants variants;
    const char *name;
    vkb_variant_add *add;
    uint32_t least_pixels;  // of the target
};

// On a GPU, strips are slow in small images, since one invocation writes a complete strip. On an
// H200, halving to 512 x 512 takes 29 us in strips and 56 pixel by pixel; to 256 x 256 it takes 25
// and 18. Doubling to 1024 x 1024 takes 33 and 45; to 512 x 512, 29 and 15.
enum { HALVE_STRIPS = 1 << 17, DOUBLE_STRIPS = 1 << 19 };

// A filter as two passes instead of one is slow in small images, since each pass takes time to
// start.
enum { TWO_PASSES = 1 << 12 };

static const struct variant variants_table[] = {
    {VKB_VARIANTS_CPU, "line", vkb_add_line, 0},
    {VKB_VARIANTS_CPU, "enlarged", vkb_add_enlarged, 0},
    {VKB_VARIANTS_CPU, "strips", vkb_add_strips, 0},
    {VKB_VARIANTS_CPU, "from_lines", vkb_add_from_lines, 0},
    {VKB_VARIANTS_CPU, "halved", vkb_add_halved, 0},
    {VKB_VARIANTS_CPU, "halved", vkb_add_halved_taps, 0},
    {VKB_VARIANTS_CPU, "halved", vkb_add_godot_rows, 0},
    {VKB_VARIANTS_CPU, "halved", vkb_add_reduced, 0},
    {VKB_VARIANTS_CPU, "halved", vkb_add_halved_grid, 0},
    {VKB_VARIANTS_CPU, "shrunk", vkb_add_shrunk, 0},
    {VKB_VARIANTS_CPU, "line", vkb_add_hdrp_line, 0},
    {VKB_VARIANTS_CPU, "doubled", vkb_add_doubled, 0},
    {VKB_VARIANTS_CPU, "doubled_final", vkb_add_doubled_final, 0},
    {VKB_VARIANTS_CPU, "upsampled", vkb_add_upsampled_strips, 0},
    {VKB_VARIANTS_CPU, "upsampled_final", vkb_add_upsampled_final, 0},
    {VKB_VARIANTS_CPU, "upsampled", vkb_add_upsampled, TWO_PASSES},
    {VKB_VARIANTS_CPU, "gathered", vkb_add_gathered, TWO_PASSES},
    {VKB_VARIANTS_CPU, "upsampled", vkb_add_kawase_up, 0},
    {VKB_VARIANTS_CPU, "strips", vkb_add_streaks, 0},
    {VKB_VARIANTS_CPU, "words", add_transform, 0},
    {VKB_VARIANTS_CPU, "pixels", add_pixels, 0},
    {VKB_VARIANTS_GPU, "enlarged", vkb_add_enlarged, 0},
    {VKB_VARIANTS_GPU, "from_lines", vkb_add_from_lines, 0},
    {VKB_VARIANTS_GPU, "tiles", vkb_add_tiles, 0},
    {VKB_VARIANTS_GPU, "lines", vkb_add_lines, 0},
    {VKB_VARIANTS_GPU, "halved", vkb_add_halved, HALVE_STRIPS},
    {VKB_VARIANTS_GPU, "doubled", vkb_add_doubled, DOUBLE_STRIPS},
    {VKB_VARIANTS_GPU, "doubled_final", vkb_add_doubled_final, DOUBLE_STRIPS},
    {VKB_VARIANTS_GPU, "pixels", add_pixels, 0},
};

// Names the rows from `first` on after the table's variant. A row before a fused pass is the
// method's own pass.
static void name_variant(struct vkb_graph *graph, uint32_t first, const char *name)
{
    for (uint32_t i = first; i < graph->pass_count; ++i) {
        struct vkb_pass_row *pass = &graph->passes[i];
        const bool own = i + 1 < graph->pass_count && pass[1].fused;
        pass->variant = !own ? name : pass->geometry == VKB_GEOMETRY_DISPATCH ? "pixels" : NULL;
    }
}

static bool add_variant(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                        struct vkb_error *error)
{
    const struct vkb_image_row *target = &choice->plain.images[pass->targets[0]];
    const uint64_t pixels = (uint64_t)target->width * target->height;

    for (size_t i = 0; i < sizeof variants_table / sizeof variants_table[0]; ++i) {
        const uint32_t first = choice->graph->pass_count;
        bool fits = false;
        if (variants_table[i].variants != choice->variants
            || pixels < variants_table[i].least_pixels)
            continue;
        if (!variants_table[i].add(choice, pass, &fits, error))
            return false;
        if (!fits)
            continue;
        name_variant(choice->graph, first, variants_table[i].name);
        return true;
    }
    return vkb_graph_add_pass(choice->graph, pass, error);
}

bool vkb_variants_choose(enum vkb_variants variants, const struct vkb_device *device,
                         struct vkb_graph *graph, struct vkb_error *error)
{
    struct vkb_variant_choice choice = {
        .variants = variants,
        .device = device,
        .plain = *graph,
        .graph = graph,
    };
    bool done = true;

    if (variants == VKB_VARIANTS_FRAGMENT)
        return true;
    // The graph keeps its images and gets new passes.
    graph->passes = NULL;
    graph->pass_count = 0;
    graph->pass_capacity = 0;
    for (uint32_t i = 0; done && i < choice.plain.pass_count; ++i) {
        // Adding an image may move the array.
        choice.plain.images = graph->images;
        done = add_variant(&choice, &choice.plain.passes[i], error);
    }
    vkb_free(choice.plain.passes);
    return done;
}
