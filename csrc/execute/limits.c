#include "execute/limits.h"

#include <math.h>
#include <string.h>

struct need {
    const char *what, *limit;
    uint64_t needed, allowed;
};

static bool check(const struct vkb_device *device, const struct vkb_pass_row *pass,
                  const struct need *needs, size_t count, struct vkb_error *error)
{
    for (const struct need *need = needs; need < needs + count; ++need)
        if (need->needed > need->allowed)
            return vkb_fail(error, VKB_ERROR_VALUE,
                            "passes: %s needs %llu %s; the adapter %s allows %llu (%s)", pass->name,
                            (unsigned long long)need->needed, need->what, device->adapter.name,
                            (unsigned long long)need->allowed, need->limit);
    return true;
}

enum { DRAW_NEEDS = 8 };  // the others are of dispatches

// A row of needs: what a pass needs this many of, and the limit of Vulkan of this name.
#define NEED(what, needed, limits, name) {what, #name, needed, (limits)->name}

static bool check_needs(const struct vkb_device *device, const struct vkb_pass_row *pass,
                        struct vkb_error *error)
{
    const bool dispatch = pass->geometry == VKB_GEOMETRY_DISPATCH;
    const uint32_t targets = dispatch ? 0 : pass->target_count;
    const VkPhysicalDeviceLimits *limits = &device->limits;
    const uint32_t *threads = pass->shader->threads, *size = limits->maxComputeWorkGroupSize;
    uint32_t counts[VKB_RESOURCE_KINDS] = {
        [VKB_RESOURCE_TEXTURE] = pass->read_count,
        [VKB_RESOURCE_IMAGE] = dispatch ? pass->target_count : 0,
        [VKB_RESOURCE_UNIFORM] = 1,  // the parameters
    };
    for (uint32_t i = 0; i < pass->resource_count; ++i)
        ++counts[pass->resources[i]->kind];
    const uint32_t textures = counts[VKB_RESOURCE_TEXTURE], images = counts[VKB_RESOURCE_IMAGE];
    const uint32_t uniforms = counts[VKB_RESOURCE_UNIFORM], storage = counts[VKB_RESOURCE_STORAGE];
    const uint32_t outputs = dispatch ? 0 : images + storage + targets;
    const uint32_t bindings = textures + images + uniforms + storage + targets;
    const struct need needs[] = {
        NEED("textures", textures, limits, maxPerStageDescriptorSampledImages),
        NEED("textures", textures, limits, maxPerStageDescriptorSamplers),
        NEED("storage images", images, limits, maxPerStageDescriptorStorageImages),
        NEED("uniform buffers", uniforms, limits, maxPerStageDescriptorUniformBuffers),
        NEED("storage buffers", storage, limits, maxPerStageDescriptorStorageBuffers),
        NEED("outputs", outputs, limits, maxFragmentCombinedOutputResources),
        NEED("bindings", bindings, limits, maxPerStageResources),
        NEED("targets", targets, limits, maxColorAttachments),
        NEED("threads of a workgroup", (uint64_t)threads[0] * threads[1], limits,
             maxComputeWorkGroupInvocations),
        {"threads along x", "maxComputeWorkGroupSize", threads[0], size[0]},
        {"threads along y", "maxComputeWorkGroupSize", threads[1], size[1]},
        NEED("bytes of shared memory", pass->shader->shared, limits, maxComputeSharedMemorySize),
    };
    return check(device, pass, needs, dispatch ? sizeof needs / sizeof *needs : DRAW_NEEDS, error);
}

// Of a pass that loads what it reads: other passes of methods need no more than every device has.
static bool check_loads(const struct vkb_device *device, const struct vkb_pass_row *pass,
                        struct vkb_error *error)
{
    const struct need need = NEED("storage images", pass->read_count + pass->target_count,
                                  &device->limits, maxPerStageDescriptorStorageImages);

    return pass->reading != VKB_READING_LOADED || check(device, pass, &need, 1, error);
}

bool vkb_limits_check_image(const struct vkb_device *device, const struct vkb_image_row *row,
                            struct vkb_error *error)
{
    static const struct {
        VkImageUsageFlags usage;
        VkFormatFeatureFlags feature;
        const char *words;
    } rows[] = {
        {VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT, VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BIT, "render to"},
        {VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT,
         VK_FORMAT_FEATURE_DEPTH_STENCIL_ATTACHMENT_BIT, "render to"},
        {VK_IMAGE_USAGE_SAMPLED_BIT, VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT, "sample"},
        {VK_IMAGE_USAGE_STORAGE_BIT, VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT, "store"},
    };

    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; ++i)
        if ((row->usage & rows[i].usage)
            && !vkb_device_supports(device, row->format, rows[i].feature))
            return vkb_fail(error, VKB_ERROR_GENERAL, "the adapter %s cannot %s %s images",
                            device->adapter.name, rows[i].words, vkb_formats[row->format].name);
    return true;
}

static bool check_format(const struct vkb_device *device, const struct vkb_graph *graph,
                         uint32_t image, struct vkb_error *error)
{
    const enum vkb_format format = graph->images[image].format;

    if (!vkb_limits_check_image(device, &graph->images[image], error))
        return false;
    if (vkb_graph_blends(graph, image)
        && !vkb_device_supports(device, format, VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BLEND_BIT))
        return vkb_fail(error, VKB_ERROR_GENERAL,
                        "the adapter %s cannot add up layers in %s images, but in %s it can",
                        device->adapter.name, vkb_formats[format].name,
                        vkb_formats[VKB_FORMAT_RGBA16_FLOAT].name);
    return true;
}

// Dispatches that variants chose do not come here without them.
static bool check_passes(const struct vkb_device *device, const struct vkb_graph *graph,
                         struct vkb_error *error)
{
    for (uint32_t i = 0; i < graph->pass_count; ++i) {
        const struct vkb_pass_row *pass = &graph->passes[i];
        if (pass->geometry == VKB_GEOMETRY_DISPATCH && !device->dispatch)
            return vkb_fail(error, VKB_ERROR_GENERAL,
                            "the compute shaders of %s cannot write images, which the pass %s "
                            "needs",
                            device->adapter.name, vkb_graph_label(graph, pass->name));
        // Plans without a renderer know no limits.
        if (device->limits.maxPerStageResources
            && !(pass->block == VKB_BLOCK_custom ? check_needs(device, pass, error)
                                                 : check_loads(device, pass, error)))
            return false;
    }
    return true;
}

bool vkb_limits_check_memory(const struct vkb_device *device, const struct vkb_graph *graph,
                             uint64_t needed, struct vkb_error *error)
{
    const uint64_t largest = device->memory_limit;
    bool convolves = false;

    for (uint32_t i = 0; i < graph->image_count; ++i)
        convolves = convolves || graph->images[i].serial;
    // Plans without a renderer know none.
    if (!largest || needed <= largest)
        return true;
    vkb_fail(error, VKB_ERROR_OUT_OF_MEMORY,
             "memory is short: %llu MiB of images are needed, and the adapter %s has %llu",
             (unsigned long long)(needed >> 20), device->adapter.name,
             (unsigned long long)(largest >> 20));
    const struct vkb_image_row *image = &graph->images[0];
    const double share = sqrt((double)largest / (double)needed);
    if (convolves)
        vkb_add_words(error, "; use a smaller bloom_scale or kernel_size");
    else
        vkb_add_words(error, "; an image of %u x %u fits, or use a smaller bloom_scale",
                      (uint32_t)(share * image->width), (uint32_t)(share * image->height));
    return false;
}

bool vkb_limits_check_graph(const struct vkb_device *device, const struct vkb_graph *graph,
                            struct vkb_error *error)
{
    for (uint32_t i = 0; i < graph->image_count; ++i)
        if (!check_format(device, graph, i, error))
            return false;
    return check_passes(device, graph, error);
}
