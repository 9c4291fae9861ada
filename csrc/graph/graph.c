#include "graph/graph.h"

#include <stdio.h>
#include <string.h>

void vkb_graph_destroy(struct vkb_graph *graph)
{
    vkb_free(graph->images);
    vkb_free(graph->passes);
    vkb_free(graph->owned);
    for (uint32_t i = 0; i < graph->filter_count; ++i)
        vkb_free(graph->filters[i]);
    vkb_free(graph->filters);
    *graph = (struct vkb_graph){0};
}

void vkb_set_name(char *name, size_t size, const char *text)
{
    size_t length = 0;

    while (length + 1 < size && text[length])
        ++length;
    memcpy(name, text, length);
    memset(name + length, 0, size - length);
}

// Whether the image keeps its name as it is: a framebuffer, and what a source gives. Custom methods
// cannot give their framebuffers the names of these (methods/custom.c).
static bool is_named_by_itself(const struct vkb_image_row *row)
{
    return row->framebuffer || (row->input && row->input < VKB_INPUT_LEVEL)
        || row->name[0] == VKB_INTERNAL_NAME;
}

// Caches and plans find an image by its name.
static bool name_image(struct vkb_graph *graph, uint32_t image, const char *name,
                       struct vkb_error *error)
{
    const uint32_t named = vkb_graph_find(graph, name);

    if (named != VKB_NO_IMAGE && named != image)
        return vkb_fail(error, VKB_ERROR_GENERAL, "graph: there are two images named %s", name);
    vkb_set_name(graph->images[image].name, sizeof graph->images[image].name, name);
    return true;
}

bool vkb_graph_add_image(struct vkb_graph *graph, const struct vkb_image_row *row, uint32_t *index,
                         struct vkb_error *error)
{
    vkb_image_name name = {VKB_INTERNAL_NAME};
    const size_t prefix = is_named_by_itself(row) ? 0 : 1;

    vkb_set_name(name + prefix, sizeof name - prefix, row->name);
    if (!vkb_grow(error, &graph->images, &graph->image_capacity, graph->image_count + 1,
                  sizeof *graph->images))
        return false;
    graph->images[graph->image_count] = *row;
    if (!name_image(graph, graph->image_count, name, error))
        return false;
    if (index)
        *index = graph->image_count;
    ++graph->image_count;
    return true;
}

bool vkb_graph_show_image(struct vkb_graph *graph, uint32_t image, const char *name,
                          struct vkb_error *error)
{
    graph->images[image].framebuffer = true;
    return name_image(graph, image, name, error);
}

// Beyond all versions, which are counted, so that no recipe takes zeros for another content.
#define ZEROS_SERIAL (UINT64_C(1) << 63)

uint32_t vkb_graph_history(const struct vkb_graph *graph, uint32_t image)
{
    for (uint32_t i = 0; i < graph->image_count; ++i)
        if (vkb_is_history(&graph->images[i]) && graph->images[i].history_of == image)
            return i;
    return VKB_NO_IMAGE;
}

const struct vkb_pass_row *vkb_graph_writer(const struct vkb_graph *graph, uint32_t image)
{
    const struct vkb_pass_row *writer = NULL;

    for (uint32_t i = 0; i < graph->pass_count; ++i)
        if (graph->passes[i].target_count == 1 && graph->passes[i].targets[0] == image)
            writer = &graph->passes[i];
    return writer;
}

static uint32_t count_histories(const struct vkb_graph *graph)
{
    uint32_t count = 0;

    for (uint32_t i = 0; i < graph->image_count; ++i)
        count += vkb_is_history(&graph->images[i]);
    return count;
}

// Images of the host have these, so that the content of a history can come from there.
static bool can_keep(enum vkb_format format)
{
    return format == VKB_FORMAT_RGBA8_UNORM || format == VKB_FORMAT_RGBA16_FLOAT
        || format == VKB_FORMAT_RGBA32_FLOAT;
}

bool vkb_graph_add_history(struct vkb_graph *graph, uint32_t image, uint32_t *index,
                           struct vkb_error *error)
{
    const struct vkb_image_row *of = &graph->images[image];
    const uint32_t count = count_histories(graph);
    struct vkb_image_row row = {
        .format = of->format,
        .width = of->width,
        .height = of->height,
        .history_of = image,
        .serial = ZEROS_SERIAL,
    };

    *index = vkb_graph_history(graph, image);
    if (*index != VKB_NO_IMAGE)
        return true;
    if (!of->framebuffer)
        return vkb_fail(error, VKB_ERROR_GENERAL, "history: %s is no framebuffer", of->name);
    if (!can_keep(of->format))
        return vkb_fail(error, VKB_ERROR_VALUE,
                        "format: %s has no history in %s; use rgba8unorm, rgba16float or "
                        "rgba32float",
                        of->name, vkb_formats[of->format].name);
    if (count == VKB_MAX_HISTORIES)
        return vkb_fail(error, VKB_ERROR_VALUE,
                        "history: a frame has at most %d, and %s is one more", VKB_MAX_HISTORIES,
                        of->name);
    row.input = (enum vkb_input_kind)(VKB_INPUT_HISTORY + count);
    snprintf(row.name, sizeof row.name, "history_%u", count);
    return vkb_graph_add_image(graph, &row, index, error);
}

// Later code uses the indices without a check.
static bool has_images(const struct vkb_graph *graph, const struct vkb_pass_row *row)
{
    bool all = row->read_count <= VKB_MAX_READS && row->target_count <= VKB_MAX_TARGETS
            && (row->depth == VKB_NO_IMAGE || row->depth < graph->image_count);

    for (uint32_t i = 0; all && i < row->read_count; ++i)
        all = row->reads[i] == VKB_NO_IMAGE || row->reads[i] < graph->image_count;
    for (uint32_t i = 0; all && i < row->target_count; ++i)
        all = row->targets[i] < graph->image_count;
    return all;
}

bool vkb_graph_add_pass(struct vkb_graph *graph, const struct vkb_pass_row *row,
                        struct vkb_error *error)
{
    if (!has_images(graph, row))
        return vkb_fail(error, VKB_ERROR_GENERAL, "passes: %s needs an image that is not there",
                        row->name);
    if (!vkb_grow(error, &graph->passes, &graph->pass_capacity, graph->pass_count + 1,
                  sizeof *graph->passes))
        return false;
    graph->passes[graph->pass_count] = *row;
    if (row->target_count)
        graph->passes[graph->pass_count].constants.stored =
            (int32_t)vkb_storage_mode(graph->images[row->targets[0]].format);
    ++graph->pass_count;
    return true;
}

const struct vkb_filter *vkb_graph_keep_filters(struct vkb_graph *graph,
                                                const struct vkb_filter *filters, uint32_t count,
                                                struct vkb_error *error)
{
    struct vkb_filter *kept;

    if (!vkb_grow(error, &graph->filters, &graph->filter_capacity, graph->filter_count + 1,
                  sizeof *graph->filters)
        || !(kept = vkb_alloc(error, count, sizeof *kept)))
        return NULL;
    memcpy(kept, filters, count * sizeof *kept);
    graph->filters[graph->filter_count++] = kept;
    return kept;
}

enum vkb_mode vkb_storage_mode(enum vkb_format format)
{
    switch (format) {
#define FORMAT_CASE(argument, buffers, texels, stored, ...) \
    case VKB_FORMAT_##buffers: \
        return stored;
        VKB_BUFFER_FORMATS(FORMAT_CASE, )
#undef FORMAT_CASE
    default:
        return STORED_SINGLE;
    }
}

// A dispatch has no vertex shader.
static void pack_hash(const struct vkb_shader *shader, unsigned char *bytes, size_t *size)
{
    const struct vkb_hash hash = vkb_shader_hash(shader);

    memcpy(bytes + *size, &hash, sizeof hash);
    *size += sizeof hash;
}

// The fields that are packed as they are.
// clang-format off
#define PACKED_FIELDS(PACK) \
    PACK(name) PACK(geometry) PACK(textured) PACK(constants) PACK(reads) PACK(read_count) \
    PACK(sampling) PACK(reading) PACK(fused) PACK(block_width) PACK(block_height) PACK(groups_width) \
    PACK(groups_height) PACK(vertices) PACK(targets) PACK(target_count) PACK(depth) PACK(load) PACK(blend) \
    PACK(turn) PACK(block)
// clang-format on

#define SIZE(field) +sizeof((struct vkb_pass_row *)NULL)->field
// With those of two shaders and of the resources, and at most all parameters.
_Static_assert(0 PACKED_FIELDS(SIZE) + 2 * sizeof(struct vkb_hash) + sizeof(uint64_t)
                       + sizeof(union vkb_params)
                   <= sizeof(struct vkb_pass_row),
               "a packed row has space for all fields");
#undef SIZE

size_t vkb_pass_pack(const struct vkb_pass_row *pass, unsigned char *bytes)
{
    size_t size = 0;

    pack_hash(pass->vertex, bytes, &size);
    pack_hash(pass->shader, bytes, &size);
#define PACK(field) \
    memcpy(bytes + size, &pass->field, sizeof pass->field); \
    size += sizeof pass->field;
    PACKED_FIELDS(PACK)
#undef PACK
    // A hash of the serials: there is no space for all of them.
    uint64_t hash = VKB_HASH_START;
    for (uint32_t i = 0; i < pass->resource_count; ++i)
        hash = vkb_hash_word(hash, pass->resources[i]->serial);
    memcpy(bytes + size, &hash, sizeof hash);
    size += sizeof hash;
    return size + vkb_params_pack(pass->block, &pass->params, bytes + size);
}

// Whether passes use the image: a variant may leave out images of the method.
static bool is_used(const struct vkb_graph *graph, uint32_t image)
{
    bool used = vkb_is_given(&graph->images[image]);

    for (uint32_t i = 0; !used && i < graph->pass_count; ++i)
        used = vkb_pass_writes(&graph->passes[i], image);
    return used;
}

uint64_t vkb_image_size(const struct vkb_image_row *row)
{
    return (uint64_t)row->width * row->height * vkb_pixel_size(row->format);
}

// Compiled once for each number of channels.
static inline void repeat_grey(float *to, const float *from, uint32_t width, uint32_t channels)
{
    for (uint32_t x = 0; x < width; ++x)
        for (uint32_t channel = 0; channel < channels; ++channel)
            to[x * channels + channel] = from[x];
}

void vkb_copy_given_row(const struct vkb_image_row *image, uint32_t y, uint32_t channels, void *to)
{
    const size_t pixel = vkb_pixel_size(image->format), size = image->width * pixel;
    const size_t kept = channels * vkb_formats[image->format].channel_size;

    if (!image->pixels) {
        memset(to, 0, image->width * kept);
        return;
    }
    if (image->grey) {
        const float *from = (const float *)image->pixels + (size_t)y * image->width;
        channels == 1   ? memcpy(to, from, image->width * sizeof *from)
        : channels == 3 ? repeat_grey(to, from, image->width, 3)
                        : repeat_grey(to, from, image->width, 4);
        return;
    }
    const unsigned char *from = (const unsigned char *)image->pixels + y * size;
    if (kept == pixel)
        memcpy(to, from, size);
    else
        for (uint32_t x = 0; x < image->width; ++x)
            memcpy((unsigned char *)to + x * kept, from + x * pixel, kept);
}

bool vkb_images_alike(const struct vkb_image_row *a, const struct vkb_image_row *b)
{
    return a->format == b->format && a->width == b->width && a->height == b->height
        && a->layers == b->layers;
}

uint64_t vkb_graph_size(const struct vkb_graph *graph)
{
    uint64_t size = 0;

    for (uint32_t i = 0; i < graph->image_count; ++i)
        if (is_used(graph, i))
            size += vkb_image_size(&graph->images[i]);
    return size;
}

bool vkb_graph_same_images(const struct vkb_graph *a, const struct vkb_graph *b)
{
    if (a->image_count != b->image_count)
        return false;
    for (uint32_t i = 0; i < a->image_count; ++i) {
        const struct vkb_image_row *x = &a->images[i], *y = &b->images[i];
        if (x->format != y->format || x->width != y->width || x->height != y->height
            || x->layers != y->layers || x->serial != y->serial || strcmp(x->name, y->name) != 0)
            return false;
    }
    return true;
}

static bool share_targets(const struct vkb_pass_row *a, const struct vkb_pass_row *b)
{
    return !a->fused && !b->fused && a->geometry != VKB_GEOMETRY_DISPATCH
        && b->geometry != VKB_GEOMETRY_DISPATCH && a->target_count == b->target_count
        && a->depth == b->depth
        && memcmp(a->targets, b->targets, a->target_count * sizeof a->targets[0]) == 0;
}

static bool goes_on(const struct vkb_pass_row *first, const struct vkb_pass_row *next)
{
    return first->geometry == VKB_GEOMETRY_DISPATCH && vkb_pass_in_place(next)
        && first->targets[0] == next->targets[0];
}

uint32_t vkb_graph_group_end(const struct vkb_graph *graph, uint32_t first)
{
    uint32_t end = first + 1;

    while (end < graph->pass_count
           && (share_targets(&graph->passes[first], &graph->passes[end])
               || goes_on(&graph->passes[first], &graph->passes[end])))
        ++end;
    return end;
}

bool vkb_pass_reads(const struct vkb_pass_row *pass, uint32_t image)
{
    for (uint32_t i = 0; i < pass->read_count; ++i)
        if (pass->reads[i] == image)
            return true;
    return false;
}

bool vkb_pass_needs(const struct vkb_pass_row *pass, uint32_t slot)
{
    const uint32_t image = pass->reads[slot];

    return image != VKB_NO_IMAGE && !vkb_pass_writes(pass, image);
}

bool vkb_pass_in_place(const struct vkb_pass_row *pass)
{
    return pass->geometry == VKB_GEOMETRY_DISPATCH && vkb_pass_reads(pass, pass->targets[0]);
}

bool vkb_pass_writes(const struct vkb_pass_row *pass, uint32_t image)
{
    for (uint32_t i = 0; i < pass->target_count; ++i)
        if (pass->targets[i] == image)
            return true;
    return pass->depth == image;
}

uint32_t vkb_pass_targets(const struct vkb_pass_row *pass, uint32_t *targets)
{
    uint32_t count = 0;

    for (uint32_t i = 0; i < pass->target_count; ++i)
        targets[count++] = pass->targets[i];
    if (pass->depth != VKB_NO_IMAGE)
        targets[count++] = pass->depth;
    return count;
}

const char *vkb_graph_label(const struct vkb_graph *graph, const char *name)
{
    const bool is_internal = name[0] == VKB_INTERNAL_NAME;

    return is_internal && vkb_graph_find(graph, name + 1) == VKB_NO_IMAGE ? name + 1 : name;
}

const char *vkb_graph_timed_as(const struct vkb_graph *graph, uint32_t first)
{
    const struct vkb_pass_row *pass = &graph->passes[first];

    return vkb_graph_label(graph, pass->geometry == VKB_GEOMETRY_DISPATCH
                                      ? pass->name
                                      : graph->images[pass->targets[0]].name);
}

bool vkb_graph_blends(const struct vkb_graph *graph, uint32_t image)
{
    for (uint32_t i = 0; i < graph->pass_count; ++i)
        if (graph->passes[i].blend != VKB_BLEND_NONE && graph->passes[i].depth != image
            && vkb_pass_writes(&graph->passes[i], image))
            return true;
    return false;
}

enum vkb_access vkb_pass_reads_as(const struct vkb_pass_row *pass)
{
    if (pass->geometry != VKB_GEOMETRY_DISPATCH)
        return VKB_ACCESS_SAMPLED;
    return pass->reading == VKB_READING_SAMPLED ? VKB_ACCESS_DISPATCH_SAMPLED
                                                : VKB_ACCESS_DISPATCH_LOADED;
}

uint32_t vkb_graph_find(const struct vkb_graph *graph, const char *name)
{
    for (uint32_t i = 0; i < graph->image_count; ++i)
        if (strcmp(graph->images[i].name, name) == 0)
            return i;
    return VKB_NO_IMAGE;
}

uint32_t vkb_graph_channels(const struct vkb_graph *graph, uint32_t image)
{
    const struct vkb_image_row *row = &graph->images[image];
    return row->channels ? row->channels : vkb_formats[row->format].channels;
}

void vkb_graph_set_usages(struct vkb_graph *graph)
{
    for (uint32_t i = 0; i < graph->image_count; ++i) {
        struct vkb_image_row *row = &graph->images[i];
        const bool kept = vkb_graph_history(graph, i) != VKB_NO_IMAGE;
        // What the host has given is not read back.
        row->usage =
            (row->framebuffer && !row->serial ? vkb_access_usage(VKB_ACCESS_COPY_SOURCE) : 0)
            // The next call may read it in another way, or use it as a source.
            | (kept ? vkb_access_usage(VKB_ACCESS_SAMPLED)
                          | vkb_access_usage(VKB_ACCESS_DISPATCH_LOADED)
                    : 0);
    }
    for (uint32_t i = 0; i < graph->pass_count; ++i) {
        const struct vkb_pass_row *pass = &graph->passes[i];
        const bool draws = pass->geometry != VKB_GEOMETRY_DISPATCH;
        // Linear texels are a buffer.
        if (pass->reading == VKB_READING_LINEAR_TEXELS)
            continue;
        for (uint32_t read = 0; read < pass->read_count; ++read)
            if (pass->reads[read] != VKB_NO_IMAGE)
                graph->images[pass->reads[read]].usage |= vkb_access_usage(vkb_pass_reads_as(pass));
        for (uint32_t target = 0; target < pass->target_count; ++target)
            graph->images[pass->targets[target]].usage |=
                vkb_access_usage(draws ? VKB_ACCESS_COLOR_TARGET : VKB_ACCESS_DISPATCH_STORED);
        if (pass->depth != VKB_NO_IMAGE)
            graph->images[pass->depth].usage |= vkb_access_usage(VKB_ACCESS_DEPTH_TARGET);
    }
    // No image is without a usage, also if all passes access its linear texels.
    for (uint32_t i = 0; i < graph->image_count; ++i)
        if (graph->images[i].usage == 0)
            graph->images[i].usage = vkb_access_usage(VKB_ACCESS_COPY_SOURCE);
}

bool vkb_check_size(const char *name, uint32_t width, uint32_t height, uint32_t max_side,
                    struct vkb_error *error)
{
    if (width == 0 || height == 0 || width > max_side || height > max_side)
        return vkb_fail(error, VKB_ERROR_VALUE,
                        "%s: a size of %u x %u is out of this adapter's range, 1 to %u a side; "
                        "it must be smaller",
                        name, width, height, max_side);
    return true;
}

bool vkb_graph_check_sizes(const struct vkb_graph *graph, uint32_t max_side,
                           struct vkb_error *error)
{
    for (uint32_t i = 0; i < graph->image_count; ++i)
        if (!vkb_check_size(vkb_graph_label(graph, graph->images[i].name), graph->images[i].width,
                            graph->images[i].height, max_side, error))
            return false;
    return true;
}

static bool can_layer(const struct vkb_graph *graph)
{
    bool can = true;

    for (uint32_t i = 0; i < graph->image_count; ++i)
        can = can && !graph->images[i].serial && graph->images[i].input <= VKB_INPUT_IMAGE;
    for (uint32_t i = 0; i < graph->pass_count; ++i) {
        const struct vkb_pass_row *pass = &graph->passes[i];
        can = can && pass->geometry == VKB_GEOMETRY_DISPATCH
           && pass->reading != VKB_READING_LINEAR_TEXELS && pass->resource_count == 0
           && pass->shader->layers;
    }
    return can;
}

bool vkb_graph_layer(struct vkb_graph *graph, struct vkb_error *error)
{
    if (!can_layer(graph))
        return vkb_fail(error, VKB_ERROR_VALUE, "batch: its images have to be taken one by one");
    for (uint32_t i = 0; i < graph->pass_count; ++i)
        graph->passes[i].shader = graph->passes[i].shader->layers;
    for (uint32_t i = 0; i < graph->image_count; ++i)
        graph->images[i].layers = graph->layers;
    return true;
}
