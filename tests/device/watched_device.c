// A Vulkan layer for tests: it writes how images may be used and are,
// and which buffers are of the host's memory, and objects to acquires of
// buffers from CUDA that nothing has released. test_watched_device.py and test_cuda_path.py use it.
#define _GNU_SOURCE
#include "../core/layer.h"

#include <stdio.h>
#include <stdlib.h>

#define DEVICE_FUNCTIONS(FUNCTION) \
    FUNCTION(vkCreateImage, create_image) \
    FUNCTION(vkDestroyImage, destroy_image) \
    FUNCTION(vkCreateImageView, create_view) \
    FUNCTION(vkCmdBeginRendering, begin_rendering) \
    FUNCTION(vkUpdateDescriptorSets, update_sets) \
    FUNCTION(vkCmdCopyImageToBuffer, copy_to_buffer) \
    FUNCTION(vkCmdCopyBufferToImage, copy_to_image) \
    FUNCTION(vkCmdPipelineBarrier, barrier) \
    FUNCTION(vkCreateBuffer, create_buffer) \
    FUNCTION(vkSetDebugUtilsObjectNameEXT, set_name)

// Of the first device, and good for all.
static struct {
#define MEMBER(name, function) PFN_##name name;
    DEVICE_FUNCTIONS(MEMBER)
#undef MEMBER
} below;

// Handles are reused, so that the latest is looked for first.
static struct watched_image {
    VkImage image;
    char name[64];
    VkImageUsageFlags usage, used;
} images[1 << 14];
static struct {
    VkImageView view;
    uint32_t image;
} views[1 << 14];
static struct {
    VkBuffer buffer;
    bool owned;  // by Vulkan; a new one belongs to whoever uses it first
} buffers[1 << 14];
static uint32_t image_count, view_count, buffer_count;

static struct watched_image *find_image(VkImage image)
{
    uint32_t i = image_count;

    while (i-- > 0)
        if (images[i].image == image)
            return &images[i];
    return &images[0];
}

static void use_view(VkImageView view, VkImageUsageFlags usage)
{
    for (uint32_t i = view_count; i-- > 0;)
        if (views[i].view == view) {
            images[views[i].image].used |= usage;
            return;
        }
}

static void write_line(const char *name, VkImageUsageFlags usage, VkImageUsageFlags used)
{
    FILE *file = getenv("VKBLOOM_USAGES") ? fopen(getenv("VKBLOOM_USAGES"), "a") : NULL;

    if (!file)
        return;
    fprintf(file, "%s %x %x\n", name, usage, used);
    fclose(file);
}

static VKAPI_ATTR VkResult VKAPI_CALL create_image(VkDevice device, const VkImageCreateInfo *info,
                                                   const VkAllocationCallbacks *callbacks,
                                                   VkImage *image)
{
    const VkResult result = below.vkCreateImage(device, info, callbacks, image);

    // The first one is for handles that are not known.
    if (result == VK_SUCCESS && ++image_count < 1 << 14)
        images[image_count - 1] = (struct watched_image){.image = *image, .usage = info->usage};
    return result;
}

static VKAPI_ATTR void VKAPI_CALL destroy_image(VkDevice device, VkImage image,
                                                const VkAllocationCallbacks *callbacks)
{
    struct watched_image *watched = find_image(image);

    if (image && watched->name[0])
        write_line(watched->name, watched->usage, watched->used);
    if (image)
        watched->image = VK_NULL_HANDLE;
    below.vkDestroyImage(device, image, callbacks);
}

static VKAPI_ATTR VkResult VKAPI_CALL create_view(VkDevice device,
                                                  const VkImageViewCreateInfo *info,
                                                  const VkAllocationCallbacks *callbacks,
                                                  VkImageView *view)
{
    const VkResult result = below.vkCreateImageView(device, info, callbacks, view);

    if (result == VK_SUCCESS && view_count < 1 << 14) {
        views[view_count].view = *view;
        views[view_count++].image = (uint32_t)(find_image(info->image) - images);
    }
    return result;
}

static VKAPI_ATTR void VKAPI_CALL begin_rendering(VkCommandBuffer commands,
                                                  const VkRenderingInfo *info)
{
    for (uint32_t i = 0; i < info->colorAttachmentCount; ++i)
        use_view(info->pColorAttachments[i].imageView, VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT);
    if (info->pDepthAttachment)
        use_view(info->pDepthAttachment->imageView, VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT);
    below.vkCmdBeginRendering(commands, info);
}

static VKAPI_ATTR void VKAPI_CALL update_sets(VkDevice device, uint32_t count,
                                              const VkWriteDescriptorSet *writes,
                                              uint32_t copy_count,
                                              const VkCopyDescriptorSet *copies)
{
    for (uint32_t i = 0; i < count; ++i)
        if (writes[i].descriptorType == VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER)
            use_view(writes[i].pImageInfo->imageView, VK_IMAGE_USAGE_SAMPLED_BIT);
        else if (writes[i].descriptorType == VK_DESCRIPTOR_TYPE_STORAGE_IMAGE)
            use_view(writes[i].pImageInfo->imageView, VK_IMAGE_USAGE_STORAGE_BIT);
    below.vkUpdateDescriptorSets(device, count, writes, copy_count, copies);
}

static VKAPI_ATTR void VKAPI_CALL copy_to_buffer(VkCommandBuffer commands, VkImage image,
                                                 VkImageLayout layout, VkBuffer buffer,
                                                 uint32_t count, const VkBufferImageCopy *regions)
{
    find_image(image)->used |= VK_IMAGE_USAGE_TRANSFER_SRC_BIT;
    below.vkCmdCopyImageToBuffer(commands, image, layout, buffer, count, regions);
}

static VKAPI_ATTR void VKAPI_CALL copy_to_image(VkCommandBuffer commands, VkBuffer buffer,
                                                VkImage image, VkImageLayout layout, uint32_t count,
                                                const VkBufferImageCopy *regions)
{
    find_image(image)->used |= VK_IMAGE_USAGE_TRANSFER_DST_BIT;
    below.vkCmdCopyBufferToImage(commands, buffer, image, layout, count, regions);
}

static VKAPI_ATTR VkResult VKAPI_CALL set_name(VkDevice device,
                                               const VkDebugUtilsObjectNameInfoEXT *info)
{
    if (info->objectType == VK_OBJECT_TYPE_IMAGE)
        snprintf(find_image((VkImage)info->objectHandle)->name, 64, "%s", info->pObjectName);
    return below.vkSetDebugUtilsObjectNameEXT ? below.vkSetDebugUtilsObjectNameEXT(device, info)
                                              : VK_SUCCESS;
}

static VKAPI_ATTR VkResult VKAPI_CALL create_buffer(VkDevice device, const VkBufferCreateInfo *info,
                                                    const VkAllocationCallbacks *callbacks,
                                                    VkBuffer *buffer)
{
    const VkResult result = below.vkCreateBuffer(device, info, callbacks, buffer);
    const VkExternalMemoryBufferCreateInfo *external = info->pNext;

    if (external && external->handleTypes == VK_EXTERNAL_MEMORY_HANDLE_TYPE_HOST_ALLOCATION_BIT_EXT)
        write_line("imported", 0, 0);

    if (result == VK_SUCCESS && buffer_count < 1 << 14) {
        buffers[buffer_count].buffer = *buffer;
        buffers[buffer_count++].owned = false;
    }
    return result;
}

// Commands run in the order in which they are recorded.
static void change_owner(const VkBufferMemoryBarrier *barrier)
{
    const bool acquires = barrier->srcQueueFamilyIndex == VK_QUEUE_FAMILY_EXTERNAL;
    uint32_t i = buffer_count;

    if (acquires == (barrier->dstQueueFamilyIndex == VK_QUEUE_FAMILY_EXTERNAL))
        return;
    while (i > 0 && buffers[i - 1].buffer != barrier->buffer)
        --i;
    if (i == 0)
        return;
    if (acquires && buffers[i - 1].owned)
        object("a buffer is acquired from EXTERNAL that was not released to it");
    buffers[i - 1].owned = acquires;
}

static VKAPI_ATTR void VKAPI_CALL barrier(VkCommandBuffer commands, VkPipelineStageFlags from,
                                          VkPipelineStageFlags to, VkDependencyFlags flags,
                                          uint32_t memory_count, const VkMemoryBarrier *memory,
                                          uint32_t count, const VkBufferMemoryBarrier *given,
                                          uint32_t image_barriers,
                                          const VkImageMemoryBarrier *of_images)
{
    for (uint32_t i = 0; i < count; ++i)
        change_owner(&given[i]);
    below.vkCmdPipelineBarrier(commands, from, to, flags, memory_count, memory, count, given,
                               image_barriers, of_images);
}

static VKAPI_ATTR VkResult VKAPI_CALL create_device(VkPhysicalDevice physical,
                                                    const VkDeviceCreateInfo *info,
                                                    const VkAllocationCallbacks *callbacks,
                                                    VkDevice *created)
{
    const VkResult result = begin_device(physical, info, callbacks, created);
#define FETCH(name, function) below.name = (PFN_##name)chain.device_proc(*created, #name);
    if (result == VK_SUCCESS) {
        DEVICE_FUNCTIONS(FETCH)
    }
#undef FETCH
    return result;
}

#define OF_DEVICE(name, function) ENTRY(name, function, true),
static const struct entry entries[] = {
    ENTRY(vkGetInstanceProcAddr, get_instance_proc, false),
    ENTRY(vkCreateInstance, begin_instance, false), ENTRY(vkCreateDevice, create_device, false),
    ENTRY(vkGetDeviceProcAddr, get_device_proc, true), DEVICE_FUNCTIONS(OF_DEVICE)};

static PFN_vkVoidFunction find_own(const char *name, bool of_device)
{
    return find_entry(entries, sizeof entries / sizeof entries[0], name, of_device);
}
