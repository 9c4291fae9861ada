#include "execute/resources.h"

#include "execute/bindings.h"

#include <string.h>

static void destroy_entry(const struct vkb_device *device, struct vkb_resource_entry *entry)
{
    device->vk.vkDestroySampler(device->handle, entry->sampler, NULL);
    vkb_image_destroy(device, &entry->image);
    vkb_buffer_destroy(device, &entry->buffer);
    vkb_buffer_destroy(device, &entry->staging);
    vkb_owner_release(entry->owner);
    vkb_free(entry);
}

void vkb_resources_destroy(const struct vkb_device *device, struct vkb_resources *resources)
{
    for (size_t i = 0; i < resources->count; ++i)
        destroy_entry(device, resources->entries[i]);
    vkb_free(resources->entries);
    *resources = (struct vkb_resources){0};
}

static void remove_entry(const struct vkb_device *device, struct vkb_resources *resources,
                         size_t index)
{
    destroy_entry(device, resources->entries[index]);
    --resources->count;
    resources->entries[index] = resources->entries[resources->count];
}

// Destroys what nobody needs any more: state without an owner, and staging memory whose copy is
// done.
static void trim_done(const struct vkb_device *device, struct vkb_resources *resources,
                      const struct vkb_age *age)
{
    for (size_t i = resources->count; i-- > 0;) {
        struct vkb_resource_entry *entry = resources->entries[i];
        if (entry->filled < age->pending)
            vkb_buffer_destroy(device, &entry->staging);
        if (entry->owner && atomic_load(&entry->owner->gone) && entry->used < age->pending)
            remove_entry(device, resources, i);
    }
}

// The number of entries without an owner; *oldest gets the index of the one that was used first.
static size_t count_cached(const struct vkb_resources *resources, size_t *oldest)
{
    size_t count = 0;

    for (size_t i = 0; i < resources->count; ++i) {
        if (resources->entries[i]->owner)
            continue;
        if (count == 0 || resources->entries[i]->used < resources->entries[*oldest]->used)
            *oldest = i;
        ++count;
    }
    return count;
}

void vkb_resources_trim(const struct vkb_device *device, struct vkb_resources *resources,
                        const struct vkb_age *age)
{
    size_t oldest = 0;

    trim_done(device, resources, age);
    while (count_cached(resources, &oldest) > VKB_KEPT_RESOURCES
           && vkb_is_old(resources->entries[oldest]->used, age))
        remove_entry(device, resources, oldest);
}

void vkb_resources_drop(const struct vkb_device *device, struct vkb_resources *resources,
                        uint64_t submission)
{
    for (size_t i = resources->count; i-- > 0;)
        if (resources->entries[i]->filled == submission)
            remove_entry(device, resources, i);
}

static bool check_format(const struct vkb_device *device, const struct vkb_resource *resource,
                         struct vkb_error *error)
{
    VkFormatProperties properties;
    const VkFormatFeatureFlags needed =
        resource->kind == VKB_RESOURCE_IMAGE ? VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT
        : resource->linear                   ? VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT
                                             : VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT;

    device->instance->vk.vkGetPhysicalDeviceFormatProperties(
        device->adapter.physical, (VkFormat)resource->format, &properties);
    if ((properties.optimalTilingFeatures & needed) != needed)
        return vkb_fail(
            error, VKB_ERROR_VALUE, "passes: the adapter %s cannot %s textures of the VkFormat %u",
            device->adapter.name,
            resource->kind == VKB_RESOURCE_IMAGE ? "store" : "sample or filter", resource->format);
    return true;
}

static bool create_image(const struct vkb_device *device, const struct vkb_resource *resource,
                         struct vkb_resource_entry *entry, struct vkb_error *error)
{
    const bool stored = resource->kind == VKB_RESOURCE_IMAGE;
    const struct vkb_image_spec spec = {
        .other = (VkFormat)resource->format,
        .dimensions = resource->dimensions,
        .width = resource->width,
        .height = resource->height,
        .depth = resource->depth,
        .usage = VK_IMAGE_USAGE_TRANSFER_DST_BIT
               | (stored ? VK_IMAGE_USAGE_STORAGE_BIT : VK_IMAGE_USAGE_SAMPLED_BIT),
    };

    return check_format(device, resource, error)
        && vkb_image_create(device, &spec, &entry->image, error)
        && (stored
            || vkb_sampler_create(device, resource->linear ? VK_FILTER_LINEAR : VK_FILTER_NEAREST,
                                  (VkSamplerAddressMode)resource->border, &entry->sampler, error));
}

static bool create_entry(const struct vkb_device *device, const struct vkb_resource *resource,
                         struct vkb_resource_entry *entry, struct vkb_error *error)
{
    const VkBufferUsageFlags usage = resource->kind == VKB_RESOURCE_UNIFORM
                                       ? VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT
                                       : VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;

    if (!vkb_buffer_create(device, VKB_MEMORY_UPLOAD, VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                           resource->size, &entry->staging, error))
        return false;
    if (resource->data)
        memcpy(entry->staging.mapped, resource->data, resource->size);
    else
        memset(entry->staging.mapped, 0, resource->size);
    return vkb_buffer_flush(device, &entry->staging, error)
        && (vkb_resource_is_image(resource)
                ? create_image(device, resource, entry, error)
                : vkb_buffer_create(device, VKB_MEMORY_DEVICE,
                                    usage | VK_BUFFER_USAGE_TRANSFER_DST_BIT, resource->size,
                                    &entry->buffer, error));
}

// Records the copy of the data. All images of resources are in the general layout.
static void record_fill(const struct vkb_device *device, VkCommandBuffer commands,
                        const struct vkb_resource *resource, struct vkb_resource_entry *entry)
{
    if (vkb_resource_is_image(resource)) {
        vkb_image_fill(device, commands, &entry->image, entry->staging.handle, 0);
        vkb_image_transition(device, commands, &entry->image, VKB_ACCESS_RESOURCE);
    } else {
        device->vk.vkCmdCopyBuffer(commands, entry->staging.handle, entry->buffer.handle, 1,
                                   &(VkBufferCopy){.size = resource->size});
        vkb_barrier_record(device, commands, NULL, true, VKB_ACCESS_RESOURCE, VKB_ACCESS_RESOURCE);
    }
}

struct vkb_resource_entry *vkb_resources_find(const struct vkb_resources *resources,
                                              uint64_t serial)
{
    for (size_t i = 0; i < resources->count; ++i)
        if (resources->entries[i]->serial == serial)
            return resources->entries[i];
    return NULL;
}

bool vkb_resources_load(const struct vkb_device *device, VkCommandBuffer commands, uint64_t now,
                        const struct vkb_pass_row *pass, struct vkb_resources *resources,
                        struct vkb_error *error)
{
    for (uint32_t i = 0; i < pass->resource_count; ++i) {
        const struct vkb_resource *resource = pass->resources[i];
        struct vkb_resource_entry *entry = vkb_resources_find(resources, resource->serial);
        if (!entry) {
            entry = vkb_append(error, &resources->entries, &resources->count, &resources->capacity,
                               sizeof *entry);
            if (!entry)
                return false;
            entry->filled = now;
            // Found only when it is complete: after a failure this entry is destroyed.
            if (!create_entry(device, resource, entry, error))
                return false;
            entry->serial = resource->serial;
            entry->owner = vkb_owner_hold(resource->owner);
            record_fill(device, commands, resource, entry);
        }
        entry->used = now;
    }
    return true;
}
