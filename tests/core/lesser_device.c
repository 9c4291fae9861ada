// A Vulkan layer for tests: the device below it with less than it has. VKBLOOM_LESSER names what is
// taken, separated by commas. test_lesser_devices.py builds and uses it.
#define _GNU_SOURCE
#define VK_ENABLE_BETA_EXTENSIONS  // the portability subset
#include "layer.h"

#include <signal.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

// Functions of Vulkan, and what the layer has in their place. NULL: the layer calls them alone.
#define INSTANCE_FUNCTIONS(FUNCTION) \
    FUNCTION(vkGetPhysicalDeviceProperties, get_properties) \
    FUNCTION(vkGetPhysicalDeviceProperties2, get_properties2) \
    FUNCTION(vkGetPhysicalDeviceFeatures2, get_features) \
    FUNCTION(vkGetPhysicalDeviceFormatProperties, get_format) \
    FUNCTION(vkGetPhysicalDeviceFormatProperties2, get_format2) \
    FUNCTION(vkGetPhysicalDeviceQueueFamilyProperties, get_families) \
    FUNCTION(vkGetPhysicalDeviceQueueFamilyProperties2, get_families2) \
    FUNCTION(vkGetPhysicalDeviceMemoryProperties, get_memory) \
    FUNCTION(vkGetPhysicalDeviceSurfaceCapabilitiesKHR, get_surface) \
    FUNCTION(vkEnumerateDeviceExtensionProperties, get_extensions) \
    FUNCTION(vkGetPhysicalDeviceExternalSemaphoreProperties, get_semaphores)

#define DEVICE_FUNCTIONS(FUNCTION) \
    FUNCTION(vkGetBufferMemoryRequirements, get_buffer_requirements) \
    FUNCTION(vkGetImageMemoryRequirements, get_image_requirements) \
    FUNCTION(vkGetMemoryHostPointerPropertiesEXT, get_host_pointer) \
    FUNCTION(vkAllocateMemory, allocate) \
    FUNCTION(vkMapMemory, map_memory) \
    FUNCTION(vkFlushMappedMemoryRanges, flush) \
    FUNCTION(vkInvalidateMappedMemoryRanges, invalidate) \
    FUNCTION(vkFreeMemory, free_memory) \
    FUNCTION(vkCmdCopyBufferToImage, copy_to_image) \
    FUNCTION(vkQueueSubmit, submit) \
    FUNCTION(vkWaitForFences, wait) \
    FUNCTION(vkAcquireNextImageKHR, acquire) \
    FUNCTION(vkQueuePresentKHR, present) \
    FUNCTION(vkQueueWaitIdle, wait_idle) \
    FUNCTION(vkCreateSemaphore, create_semaphore) \
    FUNCTION(vkGetSemaphoreFdKHR, get_semaphore_file) \
    FUNCTION(vkDestroySemaphore, destroy_semaphore) \
    FUNCTION(vkCreateDescriptorSetLayout, create_layout) \
    FUNCTION(vkCreateDescriptorPool, create_pool) \
    FUNCTION(vkResetDescriptorPool, reset_pool) \
    FUNCTION(vkDestroyDescriptorPool, destroy_pool) \
    FUNCTION(vkAllocateDescriptorSets, allocate_sets) \
    FUNCTION(vkCmdClearColorImage, NULL) \
    FUNCTION(vkDeviceWaitIdle, NULL) \
    FUNCTION(vkSignalSemaphore, NULL) \
    FUNCTION(vkWaitSemaphores, NULL)

// What is below. Of the first instance and its first device, and good for all: these functions go
// by their handles.
static struct {
#define MEMBER(name, function) PFN_##name name;
    INSTANCE_FUNCTIONS(MEMBER)
    DEVICE_FUNCTIONS(MEMBER)
#undef MEMBER
} below;

static bool lacks(const char *name)
{
    const char *list = getenv("VKBLOOM_LESSER");
    const size_t length = strlen(name);

    for (; list && *list; list += strcspn(list, ","), list += *list == ',')
        if (strcspn(list, ",") == length && strncmp(list, name, length) == 0)
            return true;
    return false;
}

static void lower(uint32_t *limit, uint32_t least)
{
    *limit = *limit < least ? *limit : least;
}

static void raise_to(VkDeviceSize *alignment, VkDeviceSize most)
{
    *alignment = *alignment > most ? *alignment : most;
}

// What every device must have at the least, and no more (Vulkan 1.3, "Required Limits").
static void lower_limits(VkPhysicalDeviceLimits *limits)
{
    lower(&limits->maxImageDimension2D, 4096);
    lower(&limits->maxImageDimensionCube, 4096);
    lower(&limits->maxFramebufferWidth, 4096);
    lower(&limits->maxFramebufferHeight, 4096);
    lower(&limits->maxViewportDimensions[0], 4096);
    lower(&limits->maxViewportDimensions[1], 4096);
    lower(&limits->maxColorAttachments, 4);
    lower(&limits->maxFragmentOutputAttachments, 4);
    lower(&limits->maxFragmentCombinedOutputResources, 4);
    lower(&limits->maxFragmentInputComponents, 64);
    lower(&limits->maxVertexOutputComponents, 64);
    lower(&limits->maxUniformBufferRange, 16384);
    lower(&limits->maxTexelBufferElements, 65536);
    lower(&limits->maxStorageBufferRange, 1 << 27);
    lower(&limits->maxPerStageDescriptorSamplers, 16);
    lower(&limits->maxPerStageDescriptorUniformBuffers, 12);
    lower(&limits->maxPerStageDescriptorSampledImages, 16);
    lower(&limits->maxPerStageDescriptorStorageImages, 4);
    lower(&limits->maxPerStageDescriptorStorageBuffers, 4);
    lower(&limits->maxDescriptorSetStorageBuffers, 24);
    lower(&limits->maxPerStageResources, 128);
    lower(&limits->maxDescriptorSetSamplers, 96);
    lower(&limits->maxDescriptorSetUniformBuffers, 72);
    lower(&limits->maxDescriptorSetSampledImages, 96);
    lower(&limits->maxDescriptorSetStorageImages, 24);
    lower(&limits->maxComputeSharedMemorySize, 16384);
    lower(&limits->maxComputeWorkGroupInvocations, 128);
    lower(&limits->maxComputeWorkGroupSize[0], 128);
    lower(&limits->maxComputeWorkGroupSize[1], 128);
    lower(&limits->maxComputeWorkGroupSize[2], 64);
    for (int i = 0; i < 3; ++i)
        lower(&limits->maxComputeWorkGroupCount[i], 65535);
    lower(&limits->maxDrawIndexedIndexValue, (1u << 24) - 1);
    lower(&limits->maxMemoryAllocationCount, 4096);
    lower(&limits->maxSamplerAllocationCount, 4000);
    raise_to(&limits->minUniformBufferOffsetAlignment, 256);
    raise_to(&limits->minStorageBufferOffsetAlignment, 256);
    raise_to(&limits->minTexelBufferOffsetAlignment, 256);
    raise_to(&limits->optimalBufferCopyOffsetAlignment, 256);
    raise_to(&limits->optimalBufferCopyRowPitchAlignment, 256);
    lower(&limits->maxBoundDescriptorSets, 4);
    lower(&limits->maxPushConstantsSize, 128);
    lower(&limits->maxImageArrayLayers, 256);
    raise_to(&limits->nonCoherentAtomSize, 256);
}

// Equal GPUs of NVIDIA; the first one that is asked for has the last address.
static uint32_t gpu_number(VkPhysicalDevice physical)
{
    static VkPhysicalDevice known[8];
    uint32_t i = 0;

    while (i < 7 && known[i] && known[i] != physical)
        ++i;
    known[i] = physical;
    return i;
}

static void change_id(VkPhysicalDevice physical, VkBaseOutStructure *next)
{
    const uint32_t number = gpu_number(physical);

    for (; next; next = next->pNext) {
        if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES)
            memset(((VkPhysicalDeviceIDProperties *)next)->deviceUUID, 0xa0 + (int)number,
                   VK_UUID_SIZE);
        if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PCI_BUS_INFO_PROPERTIES_EXT)
            ((VkPhysicalDevicePCIBusInfoPropertiesEXT *)next)->pciBus = 0x3f - number;
    }
}

static void change_properties(VkPhysicalDeviceProperties *properties)
{
    if (lacks("gpus")) {
        properties->vendorID = 0x10de;
        properties->deviceType = VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU;
    }
    if (lacks("limits"))
        lower_limits(&properties->limits);
    // Less than any device may have: the validation layer must object.
    if (lacks("bindings"))
        properties->limits.maxPerStageDescriptorUniformBuffers = 0;
    if (lacks("allocations"))
        properties->limits.maxMemoryAllocationCount = 24;
    // Less than the largest image of the test has.
    if (lacks("bands"))
        lower(&properties->limits.maxStorageBufferRange, 1 << 20);
    if (lacks("wide"))
        lower(&properties->limits.maxImageDimension2D, 5000);
    if (lacks("high"))
        lower(&properties->limits.maxFramebufferHeight, 5000);
    if (lacks("cpu"))
        properties->deviceType = VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU;
}

// The first device that is asked for, of several: a GPU whose driver is not conformant.
static bool is_nonconformant(VkPhysicalDevice physical)
{
    return lacks("conformance") && gpu_number(physical) == 0;
}

static VKAPI_ATTR void VKAPI_CALL get_properties(VkPhysicalDevice physical,
                                                 VkPhysicalDeviceProperties *properties)
{
    below.vkGetPhysicalDeviceProperties(physical, properties);
    change_properties(properties);
    if (is_nonconformant(physical))
        properties->deviceType = VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU;
}

static VKAPI_ATTR void VKAPI_CALL get_properties2(VkPhysicalDevice physical,
                                                  VkPhysicalDeviceProperties2 *properties)
{
    below.vkGetPhysicalDeviceProperties2(physical, properties);
    change_properties(&properties->properties);
    if (lacks("gpus"))
        change_id(physical, properties->pNext);
    for (VkBaseOutStructure *next = properties->pNext; next; next = next->pNext)
        if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PORTABILITY_SUBSET_PROPERTIES_KHR)
            ((VkPhysicalDevicePortabilitySubsetPropertiesKHR *)next)
                ->minVertexInputBindingStrideAlignment = 4;
        else if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES
                 && lacks("limits"))
            ((VkPhysicalDeviceSubgroupProperties *)next)->subgroupSize = 64;
        else if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES
                 && is_nonconformant(physical))
            ((VkPhysicalDeviceDriverProperties *)next)->conformanceVersion =
                (VkConformanceVersion){0};
        else if (next->sType
                     == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_EXTERNAL_MEMORY_HOST_PROPERTIES_EXT
                 && lacks("limits"))
            raise_to(&((VkPhysicalDeviceExternalMemoryHostPropertiesEXT *)next)
                          ->minImportedHostPointerAlignment,
                     65536);
}

static VKAPI_ATTR void VKAPI_CALL get_features(VkPhysicalDevice physical,
                                               VkPhysicalDeviceFeatures2 *features)
{
    below.vkGetPhysicalDeviceFeatures2(physical, features);
    if (lacks("storage"))
        features->features.shaderStorageImageWriteWithoutFormat = VK_FALSE;
    if (lacks("extended"))
        features->features.shaderStorageImageExtendedFormats = VK_FALSE;
}

static void change_format(VkFormat format, VkFormatProperties *properties)
{
    VkFormatFeatureFlags taken = 0;

    if (format == VK_FORMAT_R32G32B32A32_SFLOAT && lacks("blend"))
        taken |= VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BLEND_BIT;
    if (format == VK_FORMAT_R32G32B32A32_SFLOAT && lacks("filter"))
        taken |= VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT;
    if ((format == VK_FORMAT_R8G8B8A8_UNORM && lacks("store8"))
        || (format == VK_FORMAT_R16G16B16A16_SFLOAT && lacks("store16"))
        || (format == VK_FORMAT_R32G32B32A32_SFLOAT && lacks("store32"))
        || (format == VK_FORMAT_R32_SFLOAT && lacks("store1"))
        || (format == VK_FORMAT_R32G32_SFLOAT && lacks("store2")))
        taken |= VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT;
    if (format == VK_FORMAT_D32_SFLOAT && lacks("depth"))
        taken |= VK_FORMAT_FEATURE_DEPTH_STENCIL_ATTACHMENT_BIT;
    properties->linearTilingFeatures &= ~taken;
    properties->optimalTilingFeatures &= ~taken;
}

static VKAPI_ATTR void VKAPI_CALL get_format(VkPhysicalDevice physical, VkFormat format,
                                             VkFormatProperties *properties)
{
    below.vkGetPhysicalDeviceFormatProperties(physical, format, properties);
    change_format(format, properties);
}

static VKAPI_ATTR void VKAPI_CALL get_format2(VkPhysicalDevice physical, VkFormat format,
                                              VkFormatProperties2 *properties)
{
    below.vkGetPhysicalDeviceFormatProperties2(physical, format, properties);
    change_format(format, &properties->formatProperties);
    for (VkBaseOutStructure *next = properties->pNext; next; next = next->pNext)
        if (next->sType == VK_STRUCTURE_TYPE_FORMAT_PROPERTIES_3) {
            VkFormatProperties3 *third = (VkFormatProperties3 *)next;
            third->linearTilingFeatures &= ~(VkFormatFeatureFlags2)0xffffffff
                                         | properties->formatProperties.linearTilingFeatures;
            third->optimalTilingFeatures &= ~(VkFormatFeatureFlags2)0xffffffff
                                          | properties->formatProperties.optimalTilingFeatures;
        }
}

static VKAPI_ATTR void VKAPI_CALL get_families(VkPhysicalDevice physical, uint32_t *count,
                                               VkQueueFamilyProperties *families)
{
    below.vkGetPhysicalDeviceQueueFamilyProperties(physical, count, families);
    for (uint32_t i = 0; families && i < *count && lacks("timestamps"); ++i)
        families[i].timestampValidBits = 0;
}

static VKAPI_ATTR void VKAPI_CALL get_families2(VkPhysicalDevice physical, uint32_t *count,
                                                VkQueueFamilyProperties2 *families)
{
    below.vkGetPhysicalDeviceQueueFamilyProperties2(physical, count, families);
    for (uint32_t i = 0; families && i < *count && lacks("timestamps"); ++i)
        families[i].queueFamilyProperties.timestampValidBits = 0;
}

static VKAPI_ATTR VkResult VKAPI_CALL get_extensions(VkPhysicalDevice physical, const char *layer,
                                                     uint32_t *count,
                                                     VkExtensionProperties *extensions)
{
    const uint32_t room = *count;
    if (lacks("query") && gpu_number(physical) == 0)
        return VK_ERROR_OUT_OF_HOST_MEMORY;
    VkResult result =
        below.vkEnumerateDeviceExtensionProperties(physical, layer, count, extensions);

    const char *added = lacks("waits")       ? VK_KHR_EXTERNAL_SEMAPHORE_FD_EXTENSION_NAME
                      : lacks("portability") ? VK_KHR_PORTABILITY_SUBSET_EXTENSION_NAME
                                             : NULL;
    if (added && (!extensions || *count < room)) {
        if (extensions) {
            extensions[*count] = (VkExtensionProperties){.specVersion = 1};
            strcpy(extensions[*count].extensionName, added);
        }
        ++*count;
    }
    if (lacks("gpus") && extensions && *count > 0)
        strcpy(extensions[0].extensionName, VK_EXT_PCI_BUS_INFO_EXTENSION_NAME);
    for (uint32_t i = 0; extensions && i < *count && lacks("import"); ++i)
        if (strcmp(extensions[i].extensionName, "VK_EXT_external_memory_host") == 0)
            strcpy(extensions[i].extensionName, "VK_EXT_another");
    return result;
}

// Memory of the device's own, the host's without a cache, and the host's with one that is not
// coherent: all of them the one type below.
enum { DEVICE_TYPE, COHERENT_TYPE, CACHED_TYPE, TYPE_COUNT };

static VKAPI_ATTR void VKAPI_CALL get_memory(VkPhysicalDevice physical,
                                             VkPhysicalDeviceMemoryProperties *memory)
{
    static const VkMemoryPropertyFlags flags[TYPE_COUNT] = {
        [DEVICE_TYPE] = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT,
        [COHERENT_TYPE] =
            VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT,
        [CACHED_TYPE] = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_CACHED_BIT,
    };

    below.vkGetPhysicalDeviceMemoryProperties(physical, memory);
    for (uint32_t i = 0; i < memory->memoryHeapCount; ++i)
        if (lacks("heap") || lacks("room"))
            memory->memoryHeaps[i].size = lacks("room") ? 16 << 20 : 256 << 20;
    if (!lacks("memory"))
        return;
    memory->memoryTypeCount = TYPE_COUNT;
    memory->memoryHeapCount = 2;
    memory->memoryHeaps[1] = (VkMemoryHeap){.size = memory->memoryHeaps[0].size};
    memory->memoryHeaps[0].size /= 2;
    for (int i = 0; i < TYPE_COUNT; ++i)
        memory->memoryTypes[i] = (VkMemoryType){flags[i], i != DEVICE_TYPE};
}

static void change_requirements(VkMemoryRequirements *requirements)
{
    if (lacks("memory"))
        requirements->memoryTypeBits = (1 << TYPE_COUNT) - 1;
}

static VKAPI_ATTR void VKAPI_CALL get_buffer_requirements(VkDevice handle, VkBuffer buffer,
                                                          VkMemoryRequirements *requirements)
{
    below.vkGetBufferMemoryRequirements(handle, buffer, requirements);
    change_requirements(requirements);
}

static VKAPI_ATTR void VKAPI_CALL get_image_requirements(VkDevice handle, VkImage image,
                                                         VkMemoryRequirements *requirements)
{
    below.vkGetImageMemoryRequirements(handle, image, requirements);
    change_requirements(requirements);
}

static VKAPI_ATTR VkResult VKAPI_CALL get_host_pointer(VkDevice handle,
                                                       VkExternalMemoryHandleTypeFlagBits type,
                                                       const void *pointer,
                                                       VkMemoryHostPointerPropertiesEXT *properties)
{
    VkResult result = below.vkGetMemoryHostPointerPropertiesEXT(handle, type, pointer, properties);

    // The host's own memory is cached, and whoever imports it cannot invalidate it.
    if (lacks("memory"))
        properties->memoryTypeBits = 1 << CACHED_TYPE;
    return result;
}

// Memory that is not coherent: the host sees a copy, which only a flush or an invalidation renews.
static struct copied_memory {
    VkDeviceMemory memory;
    VkDeviceSize size;
    char *real, *copy;
} copied[1 << 10];

static struct copied_memory *find_copied(VkDeviceMemory memory)
{
    for (int i = 0; i < 1 << 10; ++i)
        if (copied[i].memory == memory)
            return &copied[i];
    return NULL;
}

static VKAPI_ATTR VkResult VKAPI_CALL allocate(VkDevice handle, const VkMemoryAllocateInfo *info,
                                               const VkAllocationCallbacks *callbacks,
                                               VkDeviceMemory *memory)
{
    VkMemoryAllocateInfo changed = *info;

    if (lacks("memory"))
        changed.memoryTypeIndex = 0;
    const VkResult result = below.vkAllocateMemory(handle, &changed, callbacks, memory);
    struct copied_memory *unused = find_copied(VK_NULL_HANDLE);
    if (result == VK_SUCCESS && lacks("memory") && info->memoryTypeIndex == CACHED_TYPE && unused)
        *unused = (struct copied_memory){.memory = *memory, .size = info->allocationSize};
    return result;
}

static VKAPI_ATTR VkResult VKAPI_CALL map_memory(VkDevice handle, VkDeviceMemory memory,
                                                 VkDeviceSize offset, VkDeviceSize size,
                                                 VkMemoryMapFlags flags, void **data)
{
    const VkResult result = below.vkMapMemory(handle, memory, offset, size, flags, data);
    struct copied_memory *found = find_copied(memory);

    // (The core maps all of it.)
    if (result != VK_SUCCESS || !found || offset > 0 || !(found->copy = malloc(found->size)))
        return result;
    found->real = *data;
    *data = memcpy(found->copy, found->real, found->size);
    return result;
}

static VkResult copy_ranges(uint32_t count, const VkMappedMemoryRange *ranges, bool to_host)
{
    for (uint32_t i = 0; i < count; ++i) {
        const struct copied_memory *found = find_copied(ranges[i].memory);
        if (!found || !found->copy)
            continue;
        const VkDeviceSize start = ranges[i].offset, rest = found->size - start;
        const VkDeviceSize size = ranges[i].size < rest ? ranges[i].size : rest;
        memcpy((to_host ? found->copy : found->real) + start,
               (to_host ? found->real : found->copy) + start, size);
    }
    return VK_SUCCESS;
}

static VKAPI_ATTR VkResult VKAPI_CALL flush(VkDevice handle, uint32_t count,
                                            const VkMappedMemoryRange *ranges)
{
    (void)handle;
    return copy_ranges(count, ranges, false);
}

static VKAPI_ATTR VkResult VKAPI_CALL invalidate(VkDevice handle, uint32_t count,
                                                 const VkMappedMemoryRange *ranges)
{
    (void)handle;
    return copy_ranges(count, ranges, true);
}

static VKAPI_ATTR void VKAPI_CALL free_memory(VkDevice handle, VkDeviceMemory memory,
                                              const VkAllocationCallbacks *callbacks)
{
    struct copied_memory *found = memory ? find_copied(memory) : NULL;

    if (found) {
        free(found->copy);
        *found = (struct copied_memory){0};
    }
    below.vkFreeMemory(handle, memory, callbacks);
}

// Without "texels", the 64 texels with which the core finds out how they are read are others.
static VKAPI_ATTR void VKAPI_CALL copy_to_image(VkCommandBuffer commands, VkBuffer buffer,
                                                VkImage image, VkImageLayout layout, uint32_t count,
                                                const VkBufferImageCopy *regions)
{
    below.vkCmdCopyBufferToImage(commands, buffer, image, layout, count, regions);
    if (lacks("texels") && regions->imageExtent.width == 64 && regions->imageExtent.height == 1)
        below.vkCmdClearColorImage(
            commands, image, layout, &(VkClearColorValue){.float32 = {0.3f, 0.3f, 0.3f, 0.3f}}, 1,
            &(VkImageSubresourceRange){VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1});
}

// Semaphores that presentations wait for. Only a wait for the queue tells that they have waited: a
// semaphore must not be destroyed before, which the validation layer does not see.
static struct {
    VkSemaphore semaphores[256];
    uint32_t count;
    bool suboptimal;  // the swapchain should be renewed, which begins with a look at the surface
} presented;

static VKAPI_ATTR VkResult VKAPI_CALL present(VkQueue queue, const VkPresentInfoKHR *info)
{
    for (uint32_t i = 0; i < info->waitSemaphoreCount; ++i)
        presented.semaphores[presented.count++ % 256] = info->pWaitSemaphores[i];
    const VkResult result = below.vkQueuePresentKHR(queue, info);
    presented.suboptimal = result == VK_SUCCESS && lacks("fit");
    return presented.suboptimal ? VK_SUBOPTIMAL_KHR : result;
}

static VKAPI_ATTR VkResult VKAPI_CALL acquire(VkDevice handle, VkSwapchainKHR swapchain,
                                              uint64_t timeout, VkSemaphore semaphore,
                                              VkFence fence, uint32_t *index)
{
    if (presented.suboptimal)
        object("a suboptimal swapchain is used again");
    if (lacks("date"))
        return VK_ERROR_OUT_OF_DATE_KHR;
    return below.vkAcquireNextImageKHR(handle, swapchain, timeout, semaphore, fence, index);
}

// As of a minimized window: some systems say that it has no area, or only its title.
static VKAPI_ATTR VkResult VKAPI_CALL get_surface(VkPhysicalDevice physical, VkSurfaceKHR surface,
                                                  VkSurfaceCapabilitiesKHR *capabilities)
{
    const VkResult result =
        below.vkGetPhysicalDeviceSurfaceCapabilitiesKHR(physical, surface, capabilities);

    presented.suboptimal = false;
    if (lacks("area"))
        capabilities->currentExtent = (VkExtent2D){0, 0};
    if (lacks("height"))
        capabilities->currentExtent.height = 0;
    return result;
}

static VKAPI_ATTR VkResult VKAPI_CALL wait_idle(VkQueue queue)
{
    presented.count = 0;
    if (lacks("end"))
        object("this wait would not end");
    return below.vkQueueWaitIdle(queue);
}

static VkFence after_all;  // of a submission of nothing

static VKAPI_ATTR VkResult VKAPI_CALL submit(VkQueue queue, uint32_t count,
                                             const VkSubmitInfo *infos, VkFence fence)
{
    if (count == 0)
        after_all = fence;
    return below.vkQueueSubmit(queue, count, infos, fence);
}

// Without "waits", the host need not wait for CUDA: the stand-in for it (cuda_stand_in.c) shares
// the device's timeline semaphores. A file describes each.
struct shared_semaphore {
    void (*signal)(void *device, uint64_t semaphore, uint64_t value);
    void (*wait)(void *device, uint64_t semaphore, uint64_t value);
    void *device;
    uint64_t semaphore;
};

static void signal_shared(void *handle, uint64_t semaphore, uint64_t value)
{
    below.vkSignalSemaphore(handle, &(VkSemaphoreSignalInfo){
                                        .sType = VK_STRUCTURE_TYPE_SEMAPHORE_SIGNAL_INFO,
                                        .semaphore = (VkSemaphore)semaphore,
                                        .value = value,
                                    });
}

static void wait_shared(void *handle, uint64_t semaphore, uint64_t value)
{
    below.vkWaitSemaphores(handle,
                           &(VkSemaphoreWaitInfo){
                               .sType = VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO,
                               .semaphoreCount = 1,
                               .pSemaphores = &(VkSemaphore){(VkSemaphore)semaphore},
                               .pValues = &value,
                           },
                           UINT64_MAX);
}

static VKAPI_ATTR void VKAPI_CALL get_semaphores(VkPhysicalDevice physical,
                                                 const VkPhysicalDeviceExternalSemaphoreInfo *info,
                                                 VkExternalSemaphoreProperties *properties)
{
    below.vkGetPhysicalDeviceExternalSemaphoreProperties(physical, info, properties);
    if (!lacks("waits"))
        return;
    properties->externalSemaphoreFeatures = VK_EXTERNAL_SEMAPHORE_FEATURE_EXPORTABLE_BIT;
    properties->compatibleHandleTypes = properties->exportFromImportedHandleTypes =
        VK_EXTERNAL_SEMAPHORE_HANDLE_TYPE_OPAQUE_FD_BIT;
}

static VKAPI_ATTR VkResult VKAPI_CALL create_semaphore(VkDevice handle,
                                                       const VkSemaphoreCreateInfo *info,
                                                       const VkAllocationCallbacks *callbacks,
                                                       VkSemaphore *semaphore)
{
    VkSemaphoreCreateInfo changed = *info;
    VkSemaphoreTypeCreateInfo type;

    // What the core chains behind the type says only that it is exported.
    if (lacks("waits") && info->pNext) {
        type = *(const VkSemaphoreTypeCreateInfo *)info->pNext;
        type.pNext = NULL;
        changed.pNext = &type;
    }
    return below.vkCreateSemaphore(handle, &changed, callbacks, semaphore);
}

static VKAPI_ATTR VkResult VKAPI_CALL get_semaphore_file(VkDevice handle,
                                                         const VkSemaphoreGetFdInfoKHR *info,
                                                         int *descriptor)
{
    const struct shared_semaphore shared = {signal_shared, wait_shared, handle,
                                            (uint64_t)info->semaphore};

    *descriptor = memfd_create("semaphore", 0);
    return write(*descriptor, &shared, sizeof shared) == sizeof shared ? VK_SUCCESS
                                                                       : VK_ERROR_TOO_MANY_OBJECTS;
}

static VKAPI_ATTR void VKAPI_CALL destroy_semaphore(VkDevice handle, VkSemaphore semaphore,
                                                    const VkAllocationCallbacks *callbacks)
{
    for (uint32_t i = 0; semaphore && i < presented.count && i < 256; ++i)
        if (presented.semaphores[i] == semaphore) {
            object("a presentation may still wait for the semaphore");
            break;
        }
    // After Mesa has signalled a fence, its thread of the queue still writes to the timelines of
    // the submission, which none of its own users can destroy so early: lavapipe exports none.
    if (lacks("waits"))
        below.vkDeviceWaitIdle(handle);
    below.vkDestroySemaphore(handle, semaphore, callbacks);
}

// Without "patience", the user presses Ctrl-C during the wait, after the validation layer has
// objected. Without "end", presentations never end. Without "device", it is lost.
static VKAPI_ATTR VkResult VKAPI_CALL wait(VkDevice handle, uint32_t count, const VkFence *fences,
                                           VkBool32 all, uint64_t timeout)
{
    if (lacks("end") && fences[0] == after_all)
        return VK_TIMEOUT;
    if (lacks("device")) {
        // No work of a lost device goes on: all that it uses may be destroyed.
        below.vkDeviceWaitIdle(handle);
        return VK_ERROR_DEVICE_LOST;
    }
    if (!lacks("patience"))
        return below.vkWaitForFences(handle, count, fences, all, timeout);
    object("an objection");
    // The work is over by then, so that the renderer may drop the submission at once.
    below.vkWaitForFences(handle, count, fences, all, UINT64_MAX);
    raise(SIGINT);
    return VK_TIMEOUT;
}

// Pools give no more than they were created for ("pools"): sets, and descriptors of each type.
enum { DESCRIPTOR_TYPES = VK_DESCRIPTOR_TYPE_INPUT_ATTACHMENT + 1, MAX_COUNTED = 1 << 10 };
struct counted {
    uint64_t handle;
    uint32_t sets, types[DESCRIPTOR_TYPES];
};
static struct counted_pool {
    struct counted whole, left;
} pools[MAX_COUNTED];
static struct counted layouts[MAX_COUNTED];
static uint32_t layout_count;

static struct counted_pool *find_pool(VkDescriptorPool handle)
{
    uint32_t i = 0;

    while (i < MAX_COUNTED - 1 && pools[i].whole.handle != (uint64_t)handle)
        ++i;
    return &pools[i];
}

static VKAPI_ATTR VkResult VKAPI_CALL create_layout(VkDevice handle,
                                                    const VkDescriptorSetLayoutCreateInfo *info,
                                                    const VkAllocationCallbacks *callbacks,
                                                    VkDescriptorSetLayout *layout)
{
    const VkResult result = below.vkCreateDescriptorSetLayout(handle, info, callbacks, layout);
    struct counted *counted = &layouts[layout_count];

    // (The core destroys layouts only at the end.)
    layout_count += layout_count < MAX_COUNTED - 1;
    *counted = (struct counted){.handle = (uint64_t)*layout};
    for (uint32_t i = 0; i < info->bindingCount; ++i)
        counted->types[info->pBindings[i].descriptorType] += info->pBindings[i].descriptorCount;
    return result;
}

static VKAPI_ATTR VkResult VKAPI_CALL create_pool(VkDevice handle,
                                                  const VkDescriptorPoolCreateInfo *info,
                                                  const VkAllocationCallbacks *callbacks,
                                                  VkDescriptorPool *pool)
{
    const VkResult result = below.vkCreateDescriptorPool(handle, info, callbacks, pool);
    struct counted_pool *counted = find_pool(VK_NULL_HANDLE);

    counted->whole = (struct counted){.handle = (uint64_t)*pool, .sets = info->maxSets};
    for (uint32_t i = 0; i < info->poolSizeCount; ++i)
        counted->whole.types[info->pPoolSizes[i].type] += info->pPoolSizes[i].descriptorCount;
    counted->left = counted->whole;
    return result;
}

static VKAPI_ATTR VkResult VKAPI_CALL reset_pool(VkDevice handle, VkDescriptorPool pool,
                                                 VkDescriptorPoolResetFlags flags)
{
    find_pool(pool)->left = find_pool(pool)->whole;
    return below.vkResetDescriptorPool(handle, pool, flags);
}

static VKAPI_ATTR void VKAPI_CALL destroy_pool(VkDevice handle, VkDescriptorPool pool,
                                               const VkAllocationCallbacks *callbacks)
{
    if (pool)
        find_pool(pool)->whole.handle = 0;
    below.vkDestroyDescriptorPool(handle, pool, callbacks);
}

// Takes a set of the layout from the pool; false: the pool has too little.
static bool take_set(struct counted *left, VkDescriptorSetLayout layout)
{
    const struct counted *counted = layouts;
    bool fits = left->sets > 0;

    while (counted->handle != (uint64_t)layout)
        ++counted;
    for (int type = 0; type < DESCRIPTOR_TYPES; ++type)
        fits = fits && left->types[type] >= counted->types[type];
    for (int type = 0; fits && type < DESCRIPTOR_TYPES; ++type)
        left->types[type] -= counted->types[type];
    left->sets -= fits;
    return fits;
}

static VKAPI_ATTR VkResult VKAPI_CALL allocate_sets(VkDevice handle,
                                                    const VkDescriptorSetAllocateInfo *info,
                                                    VkDescriptorSet *sets)
{
    struct counted *left = &find_pool(info->descriptorPool)->left;

    for (uint32_t i = 0; lacks("pools") && i < info->descriptorSetCount; ++i)
        if (!take_set(left, info->pSetLayouts[i]))
            return VK_ERROR_OUT_OF_POOL_MEMORY;
    return below.vkAllocateDescriptorSets(handle, info, sets);
}

static VKAPI_ATTR VkResult VKAPI_CALL create_instance(const VkInstanceCreateInfo *info,
                                                      const VkAllocationCallbacks *callbacks,
                                                      VkInstance *created)
{
    const VkResult result = begin_instance(info, callbacks, created);
#define FETCH(name, function) below.name = (PFN_##name)chain.instance_proc(*created, #name);
    if (result == VK_SUCCESS && !below.vkGetPhysicalDeviceProperties) {
        INSTANCE_FUNCTIONS(FETCH)
    }
#undef FETCH
    return result;
}

static VKAPI_ATTR VkResult VKAPI_CALL create_device(VkPhysicalDevice physical,
                                                    const VkDeviceCreateInfo *info,
                                                    const VkAllocationCallbacks *callbacks,
                                                    VkDevice *created)
{
    const char *kept[64];
    VkDeviceCreateInfo changed = *info;
    changed.ppEnabledExtensionNames = kept;
    changed.enabledExtensionCount = 0;
    for (uint32_t i = 0; i < info->enabledExtensionCount; ++i)
        if ((!lacks("waits")
             || strcmp(info->ppEnabledExtensionNames[i],
                       VK_KHR_EXTERNAL_SEMAPHORE_FD_EXTENSION_NAME)
                    != 0)
            && strcmp(info->ppEnabledExtensionNames[i], VK_KHR_PORTABILITY_SUBSET_EXTENSION_NAME)
                   != 0)
            kept[changed.enabledExtensionCount++] = info->ppEnabledExtensionNames[i];
    // A device that has the extension must be created with it.
    if (lacks("portability") && changed.enabledExtensionCount == info->enabledExtensionCount)
        return VK_ERROR_INITIALIZATION_FAILED;
    const VkResult result = begin_device(physical, &changed, callbacks, created);
#define FETCH(name, function) below.name = (PFN_##name)chain.device_proc(*created, #name);
    if (result == VK_SUCCESS && !below.vkAllocateMemory) {
        DEVICE_FUNCTIONS(FETCH)
    }
#undef FETCH
    return result;
}

#define OF_INSTANCE(name, function) ENTRY(name, function, false),
#define OF_DEVICE(name, function)   ENTRY(name, function, true),
static const struct entry entries[] = {ENTRY(vkGetInstanceProcAddr, get_instance_proc, false),
                                       ENTRY(vkCreateInstance, create_instance, false),
                                       ENTRY(vkCreateDevice, create_device, false),
                                       ENTRY(vkGetDeviceProcAddr, get_device_proc, true),
                                       INSTANCE_FUNCTIONS(OF_INSTANCE) DEVICE_FUNCTIONS(OF_DEVICE)};

static PFN_vkVoidFunction find_own(const char *name, bool of_device)
{
    return find_entry(entries, sizeof entries / sizeof entries[0], name, of_device);
}
