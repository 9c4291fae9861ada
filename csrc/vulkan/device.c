#include "vulkan/device.h"

#include "vulkan/barrier.h"
#include "vulkan/process.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include <unistd.h>

VkBufferUsageFlags vkb_device_import_usage(const struct vkb_device *device)
{
    return device->adapter.device_type == VK_PHYSICAL_DEVICE_TYPE_CPU
             ? VK_BUFFER_USAGE_TRANSFER_DST_BIT | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT
                   | VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT
             : VK_BUFFER_USAGE_TRANSFER_DST_BIT;
}

// What the device can do with buffers over that kind of memory.
static VkExternalMemoryFeatureFlags external_features(const struct vkb_device *device,
                                                      VkBufferUsageFlags usage,
                                                      VkExternalMemoryHandleTypeFlagBits type)
{
    VkExternalBufferProperties properties = {
        .sType = VK_STRUCTURE_TYPE_EXTERNAL_BUFFER_PROPERTIES,
    };

    device->instance->vk.vkGetPhysicalDeviceExternalBufferProperties(
        device->adapter.physical,
        &(VkPhysicalDeviceExternalBufferInfo){
            .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_EXTERNAL_BUFFER_INFO,
            .usage = usage,
            .handleType = type,
        },
        &properties);
    return properties.externalMemoryProperties.externalMemoryFeatures;
}

static VkDeviceSize import_alignment(const struct vkb_device *device)
{
    VkPhysicalDeviceExternalMemoryHostPropertiesEXT host = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_EXTERNAL_MEMORY_HOST_PROPERTIES_EXT,
    };

    device->instance->vk.vkGetPhysicalDeviceProperties2(
        device->adapter.physical, &(VkPhysicalDeviceProperties2){
                                      .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2,
                                      .pNext = &host,
                                  });
    return host.minImportedHostPointerAlignment;
}

// Whether the device can export timeline semaphores, if it has the extension.
static bool exports_timelines(const struct vkb_device *device)
{
    const VkSemaphoreTypeCreateInfo type = {
        .sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO,
        .semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE,
    };
    VkExternalSemaphoreProperties properties = {
        .sType = VK_STRUCTURE_TYPE_EXTERNAL_SEMAPHORE_PROPERTIES,
    };

    device->instance->vk.vkGetPhysicalDeviceExternalSemaphoreProperties(
        device->adapter.physical,
        &(VkPhysicalDeviceExternalSemaphoreInfo){
            .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_EXTERNAL_SEMAPHORE_INFO,
            .pNext = &type,
            .handleType = VK_EXTERNAL_SEMAPHORE_HANDLE_TYPE_OPAQUE_FD_BIT,
        },
        &properties);
    return properties.externalSemaphoreFeatures & VK_EXTERNAL_SEMAPHORE_FEATURE_EXPORTABLE_BIT;
}

// Optional extensions. The portability subset, which a header of beta extensions names, must be
// enabled where it is; what such devices lack, no pass needs.
enum { HOST_MEMORY, SWAPCHAIN, MEMORY_FD, SEMAPHORE_FD, PORTABILITY, EXTENSION_COUNT };
static const char *const extension_names[EXTENSION_COUNT] = {
    [HOST_MEMORY] = VK_EXT_EXTERNAL_MEMORY_HOST_EXTENSION_NAME,
    [SWAPCHAIN] = VK_KHR_SWAPCHAIN_EXTENSION_NAME,
    [MEMORY_FD] = VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME,
    [SEMAPHORE_FD] = VK_KHR_EXTERNAL_SEMAPHORE_FD_EXTENSION_NAME,
    [PORTABILITY] = "VK_KHR_portability_subset",
};

// Finds the extensions that the device can use, and what they are for.
static bool choose_extensions(struct vkb_device *device, const char *names[EXTENSION_COUNT],
                              uint32_t *count, struct vkb_error *error)
{
    bool found[EXTENSION_COUNT];

    if (!vkb_find_extensions(device->instance, device->adapter.physical, extension_names,
                             EXTENSION_COUNT, found, error))
        return false;
    const VkExternalMemoryFeatureFlags imports =
        external_features(device, vkb_device_import_usage(device),
                          VK_EXTERNAL_MEMORY_HANDLE_TYPE_HOST_ALLOCATION_BIT_EXT);
    const VkExternalMemoryFeatureFlags exports =
        external_features(device, VKB_EXPORT_USAGE, VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT);
    // A CPU reads and writes through the parent's own pages.
    const bool keeps_pages =
        device->adapter.device_type == VK_PHYSICAL_DEVICE_TYPE_CPU || vkb_fork_leaves_pinned();
    found[HOST_MEMORY] = found[HOST_MEMORY] && keeps_pages
                      && (imports & VK_EXTERNAL_MEMORY_FEATURE_IMPORTABLE_BIT)
                      && !(imports & VK_EXTERNAL_MEMORY_FEATURE_DEDICATED_ONLY_BIT);
    device->import_alignment = found[HOST_MEMORY] ? import_alignment(device) : 0;
    // It depends on the instance's extension.
    device->presents = found[SWAPCHAIN] = found[SWAPCHAIN] && device->instance->surfaces;
    device->exports = found[MEMORY_FD] =
        found[MEMORY_FD] && (exports & VK_EXTERNAL_MEMORY_FEATURE_EXPORTABLE_BIT);
    device->timelines = found[SEMAPHORE_FD] =
        found[SEMAPHORE_FD] && device->exports && exports_timelines(device);
    *count = 0;
    for (int i = 0; i < EXTENSION_COUNT; ++i)
        if (found[i])
            names[(*count)++] = extension_names[i];
    return true;
}

// The features that are enabled, of each version of Vulkan. They point to each other.
struct features {
    VkPhysicalDeviceFeatures base;
    VkPhysicalDeviceVulkan11Features vulkan11;
    VkPhysicalDeviceVulkan12Features vulkan12;
    VkPhysicalDeviceVulkan13Features vulkan13;
};

// Sets dispatch and linear_texels if the device has the features that their shaders need.
static void choose_features(struct vkb_device *device, struct features *chosen)
{
    VkPhysicalDeviceVulkan13Features available13 = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES,
    };
    VkPhysicalDeviceVulkan11Features available11 = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES,
        .pNext = &available13,
    };
    VkPhysicalDeviceVulkan12Features available12 = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES,
        .pNext = &available11,
    };
    VkPhysicalDeviceFeatures2 available2 = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2,
        .pNext = &available12,
    };
    const VkPhysicalDeviceFeatures *available = &available2.features;

    device->instance->vk.vkGetPhysicalDeviceFeatures2(device->adapter.physical, &available2);
    device->dispatch = available->shaderStorageImageWriteWithoutFormat;
    device->extended_formats = available->shaderStorageImageExtendedFormats;
    // Of the drivers for CPUs, llvmpipe alone does with linear tiling all that it does with optimal
    // tiling.
    device->linear_texels = device->adapter.device_type == VK_PHYSICAL_DEVICE_TYPE_CPU
                         && device->adapter.driver_id == VK_DRIVER_ID_MESA_LLVMPIPE
                         && available->shaderInt64 && available12.scalarBlockLayout;
    // Those without a reason are for passes that are given at run time.
    chosen->base = (VkPhysicalDeviceFeatures){
        .shaderStorageImageWriteWithoutFormat = device->dispatch,
        .shaderStorageImageReadWithoutFormat = available->shaderStorageImageReadWithoutFormat,
        .shaderInt64 = available->shaderInt64,  // linear texels
        .shaderInt16 = available->shaderInt16,
        .fragmentStoresAndAtomics = available->fragmentStoresAndAtomics,
        .shaderStorageImageExtendedFormats = device->extended_formats,
        .shaderImageGatherExtended = available->shaderImageGatherExtended,
    };
    chosen->vulkan13 = (VkPhysicalDeviceVulkan13Features){
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES,
        .dynamicRendering = VK_TRUE,  // all passes
        // An input can have fewer components than the vertex shader's output.
        .maintenance4 = available13.maintenance4,
        .shaderDemoteToHelperInvocation = available13.shaderDemoteToHelperInvocation,
        // Texels beyond the edge are zero.
        .robustImageAccess = available13.robustImageAccess,
    };
    chosen->vulkan11 = (VkPhysicalDeviceVulkan11Features){
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES,
        .pNext = &chosen->vulkan13,
        .shaderDrawParameters = available11.shaderDrawParameters,
    };
    chosen->vulkan12 = (VkPhysicalDeviceVulkan12Features){
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES,
        .pNext = &chosen->vulkan11,
        .scalarBlockLayout = available12.scalarBlockLayout,
        .shaderFloat16 = available12.shaderFloat16,
        .timelineSemaphore = VK_TRUE,  // submissions
    };
}

static bool create_logical(struct vkb_device *device, struct vkb_error *error)
{
    const struct vkb_instance_table *vk = &device->instance->vk;
    const char *extensions[EXTENSION_COUNT];
    uint32_t extension_count;
    struct features features;

    if (!choose_extensions(device, extensions, &extension_count, error))
        return false;
    choose_features(device, &features);
    return VK(error,
              vk->vkCreateDevice(device->adapter.physical,
                                 &(VkDeviceCreateInfo){
                                     .sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                                     .pNext = &features.vulkan12,
                                     .pEnabledFeatures = &features.base,
                                     .queueCreateInfoCount = 1,
                                     .pQueueCreateInfos =
                                         &(VkDeviceQueueCreateInfo){
                                             .sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                             .queueFamilyIndex = device->adapter.queue_family,
                                             .queueCount = 1,
                                             .pQueuePriorities = &(float){1.0f},
                                         },
                                     .enabledExtensionCount = extension_count,
                                     .ppEnabledExtensionNames = extensions,
                                 },
                                 NULL, &device->handle));
}

static uint32_t smallest(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

// What all images together can take: the largest heap; or the memory of the host, where images lie
// in that, whatever heap a driver tells of. (lavapipe tells of 2 GiB on any machine, Mesa 22.3.6.)
static uint64_t find_memory_limit(const struct vkb_device *device)
{
    uint64_t largest = 0;

    for (uint32_t i = 0; i < device->memory.memoryHeapCount; ++i)
        if (device->memory.memoryHeaps[i].size > largest)
            largest = device->memory.memoryHeaps[i].size;
    if (device->adapter.device_type != VK_PHYSICAL_DEVICE_TYPE_CPU)
        return largest;
    const long pages = sysconf(_SC_PHYS_PAGES), size = sysconf(_SC_PAGESIZE);
    const uint64_t host = pages > 0 && size > 0 ? (uint64_t)pages * (uint64_t)size : 0;
    return host > largest ? host : largest;
}

// Device properties, cached. Some are also read after device loss.
static void read_properties(struct vkb_device *device)
{
    const struct vkb_instance_table *vk = &device->instance->vk;
    VkPhysicalDeviceProperties properties;
    const VkPhysicalDeviceLimits *limits = &device->limits;

    vk->vkGetPhysicalDeviceMemoryProperties(device->adapter.physical, &device->memory);
    device->memory_limit = find_memory_limit(device);
    vk->vkGetPhysicalDeviceProperties(device->adapter.physical, &properties);
    device->limits = properties.limits;
    device->max_side = smallest(smallest(limits->maxFramebufferWidth, limits->maxFramebufferHeight),
                                smallest(limits->maxImageDimension2D, VKB_MAX_SIDE));
    for (int format = VKB_FORMAT_NONE + 1; format < VKB_FORMAT_COUNT; ++format) {
        VkFormatProperties ways;
        vk->vkGetPhysicalDeviceFormatProperties(device->adapter.physical, vkb_formats[format].vk,
                                                &ways);
        device->features[format] = ways.optimalTilingFeatures;
    }
}

// Whether compute shaders can write images of every format that methods have. (Drawing must do
// elsewhere. Spectra in complete lines are a variant's.)
static bool stores_all(const struct vkb_device *device)
{
    for (int format = VKB_FORMAT_NONE + 1; format <= VKB_FORMAT_R32_FLOAT; ++format)
        if (!vkb_device_supports(device, (enum vkb_format)format,
                                 VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT))
            return false;
    return true;
}

// A thread of lavapipe with memory for its allocations, twice.
enum { DEVICE_MIB = 192 };

static bool find_adapter(struct vkb_device *device, uint32_t number, struct vkb_error *error)
{
    struct vkb_adapter_info adapters[VKB_MAX_ADAPTERS];
    uint32_t count;

    if (!vkb_adapters_list(device->instance, adapters, &count, error))
        return false;
    if (number >= count)
        return vkb_fail(error, VKB_ERROR_ADAPTER_NOT_FOUND,
                        "no Vulkan adapter %u: there are %u. %s", number, count, vkb_install_hint);
    device->adapter = adapters[number];
    return true;
}

static bool open_adapter(struct vkb_device *device, uint32_t number, const char *driver,
                         bool validation, struct vkb_error *error)
{
    if (!(device->instance = vkb_instance_open(driver, validation, error))
        || !find_adapter(device, number, error))
        return false;
    return device->adapter.driver_id != VK_DRIVER_ID_MESA_LLVMPIPE
        || (vkb_instance_claim(&device->instance, error) && find_adapter(device, number, error));
}

static bool create_handle(struct vkb_device *device, uint32_t adapter, const char *driver,
                          bool validation, struct vkb_error *error)
{
    if (!(device->workers = vkb_workers_create(error))
        || !(device->allocations = vkb_alloc(error, 1, sizeof *device->allocations))
        || !open_adapter(device, adapter, driver, validation, error)
        || (device->adapter.device_type == VK_PHYSICAL_DEVICE_TYPE_CPU
            && !vkb_instance_require_room(
                device->instance, device->adapter.driver_id == VK_DRIVER_ID_MESA_LLVMPIPE, error))
        || !vkb_require_room("a device", DEVICE_MIB, error) || !create_logical(device, error))
        return false;
    vkb_instance_load_device(device->instance, device->handle, &device->vk);
    device->vk.vkGetDeviceQueue(device->handle, device->adapter.queue_family, 0, &device->queue);
    read_properties(device);
    device->dispatch = device->dispatch && stores_all(device);
    device->linear_texels = device->linear_texels && device->dispatch;
    return true;
}

bool vkb_device_create(struct vkb_device *device, uint32_t adapter, const char *driver,
                       bool validation, struct vkb_error *error)
{
    *device = (struct vkb_device){0};
    if (validation)
        vkb_messages_open(&device->messages);
    const struct vkb_messages *before = vkb_messages_begin(&device->messages);
    const bool done = create_handle(device, adapter, driver, validation, error);
    vkb_messages_end(before);
    if (!done) {
        vkb_device_destroy(device);
        vkb_instance_explain(error);
    }
    return done;
}

void vkb_device_destroy(struct vkb_device *device)
{
    const struct vkb_messages *before = vkb_messages_begin(&device->messages);

    vkb_workers_destroy(device->workers);
    device->workers = NULL;
    vkb_free(device->allocations);
    device->allocations = NULL;
    if (device->idle)
        device->vk.vkDestroyFence(device->handle, device->idle, NULL);
    device->idle = VK_NULL_HANDLE;
    if (device->handle)
        device->vk.vkDestroyDevice(device->handle, NULL);
    device->handle = VK_NULL_HANDLE;
    if (device->instance)
        vkb_instance_close(device->instance);
    device->instance = NULL;
    if (device->adapter.device_type == VK_PHYSICAL_DEVICE_TYPE_CPU)
        vkb_return_freed();
    vkb_messages_end(before);
    vkb_messages_close(&device->messages);
}

bool vkb_device_supports(const struct vkb_device *device, enum vkb_format format,
                         VkFormatFeatureFlags features)
{
    return (device->features[format] & features) == features;
}

void vkb_device_remember_loss(struct vkb_device *device, const struct vkb_error *error)
{
    if (error->kind != VKB_ERROR_DEVICE_LOST || device->lost)
        return;
    memcpy(device->lost_call, error->call, sizeof device->lost_call);
    device->lost = true;
}

bool vkb_device_require(const struct vkb_device *device, struct vkb_error *error)
{
    if (!device->lost)
        return true;
    vkb_fail(error, VKB_ERROR_DEVICE_LOST, "the device was lost; close the renderer");
    if (device->lost_call[0]) {
        vkb_add_words(error, ". %s reported it", device->lost_call);
        memcpy(error->call, device->lost_call, sizeof error->call);
        error->result = VK_ERROR_DEVICE_LOST;
    }
    return false;
}

static bool remember_loss(struct vkb_device *device, bool done, const struct vkb_error *error)
{
    if (!done)
        vkb_device_remember_loss(device, error);
    return done;
}

// Appends the points that there are to the semaphores and values of a submission.
static uint32_t add_points(const struct vkb_sync_point points[VKB_EXTERNAL_COUNT],
                           VkSemaphore semaphores[VKB_EXTERNAL_COUNT],
                           uint64_t values[VKB_EXTERNAL_COUNT],
                           VkPipelineStageFlags stages[VKB_EXTERNAL_COUNT])
{
    uint32_t count = 0;

    for (int other = 0; other < VKB_EXTERNAL_COUNT; ++other) {
        if (!points[other].semaphore)
            continue;
        semaphores[count] = points[other].semaphore;
        values[count] = points[other].value;
        stages[count++] = other == VKB_EXTERNAL_SCREEN ? vkb_access_stages(VKB_ACCESS_ACQUIRED)
                                                       : VK_PIPELINE_STAGE_ALL_COMMANDS_BIT;
    }
    return count;
}

bool vkb_device_submit(struct vkb_device *device, VkCommandBuffer commands,
                       const struct vkb_sync *order, VkFence fence, struct vkb_error *error)
{
    VkSemaphore waits[VKB_EXTERNAL_COUNT], signals[VKB_EXTERNAL_COUNT];
    uint64_t wait_values[VKB_EXTERNAL_COUNT], signal_values[VKB_EXTERNAL_COUNT];
    VkPipelineStageFlags stages[VKB_EXTERNAL_COUNT], unused[VKB_EXTERNAL_COUNT];
    const uint32_t wait_count = order ? add_points(order->waits, waits, wait_values, stages) : 0;
    const uint32_t signal_count =
        order ? add_points(order->signals, signals, signal_values, unused) : 0;
    const VkTimelineSemaphoreSubmitInfo values = {
        .sType = VK_STRUCTURE_TYPE_TIMELINE_SEMAPHORE_SUBMIT_INFO,
        .waitSemaphoreValueCount = wait_count,
        .pWaitSemaphoreValues = wait_values,
        .signalSemaphoreValueCount = signal_count,
        .pSignalSemaphoreValues = signal_values,
    };
    const VkSubmitInfo submit = {
        .sType = VK_STRUCTURE_TYPE_SUBMIT_INFO,
        .pNext = &values,
        .waitSemaphoreCount = wait_count,
        .pWaitSemaphores = waits,
        .pWaitDstStageMask = stages,
        .commandBufferCount = 1,
        .pCommandBuffers = &commands,
        .signalSemaphoreCount = signal_count,
        .pSignalSemaphores = signals,
    };
    bool done = VK(error, device->vk.vkQueueSubmit(device->queue, 1, &submit, fence));

    return remember_loss(device, done, error);
}

static bool fail_hung(struct vkb_device *device, double seconds, struct vkb_error *error)
{
    vkb_fail(error, VKB_ERROR_DEVICE_LOST,
             "the device has not finished within %g s; the renderer can only be closed "
             "(VKBLOOM_TIMEOUT: seconds a frame)",
             seconds);
    error->result = VK_TIMEOUT;
    snprintf(error->call, sizeof error->call, "vkWaitForFences");
    device->timed_out = true;
    return false;
}

static double seconds_since(const struct timespec *start)
{
    struct timespec now;

    timespec_get(&now, TIME_UTC);
    return (double)(now.tv_sec - start->tv_sec) + 1e-9 * (double)(now.tv_nsec - start->tv_nsec);
}

// Polls the fence for a short time before the wait that sleeps, since waking up is slow. On an H200
// a frame of 64 x 64 pixels takes 36 us instead of 57, and the transfer of 66 MB 1.30 ms instead of
// 1.75. A CPU adapter needs the thread's time itself, so it does not poll.
static void poll_fence(const struct vkb_device *device, VkFence fence)
{
    const double limit = 0.002;
    struct timespec start;

    if (device->adapter.device_type == VK_PHYSICAL_DEVICE_TYPE_CPU)
        return;
    timespec_get(&start, TIME_UTC);
    while (device->vk.vkGetFenceStatus(device->handle, fence) == VK_NOT_READY)
        // If the clock is set back, the wait ends, too.
        if (!(fabs(seconds_since(&start)) < limit))
            return;
}

bool vkb_device_wait(struct vkb_device *device, VkFence fence, uint32_t frames,
                     struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &device->vk;
    const double slice = 0.05, limit = device->frame_seconds * frames;
    double waited = 0.0;
    VkResult result;
    bool done;

    poll_fence(device, fence);
    for (;;) {
        result = VK_RESULT(
            vk->vkWaitForFences(device->handle, 1, &fence, VK_TRUE, (uint64_t)(slice * 1e9)));
        if (result != VK_TIMEOUT)
            break;
        waited += slice;
        if (device->interrupted && device->interrupted(device->context))
            return vkb_fail(error, VKB_ERROR_INTERRUPTED, "interrupted");
        if (waited >= limit)
            break;
    }
    done = result == VK_TIMEOUT ? fail_hung(device, limit, error)
                                : vkb_check(error, result, "vkWaitForFences")
                                      && VK(error, vk->vkResetFences(device->handle, 1, &fence));
    return remember_loss(device, done, error);
}

static bool finish_idle(struct vkb_device *device, struct vkb_error *error)
{
    device->idle_pending = device->idle_pending && !vkb_device_wait(device, device->idle, 1, error);
    return !device->idle_pending;
}

bool vkb_device_end_idle(struct vkb_device *device, struct vkb_error *error)
{
    return finish_idle(device, error) || error->result == VK_ERROR_DEVICE_LOST;
}

bool vkb_device_wait_idle(struct vkb_device *device, struct vkb_error *error)
{
    const VkFenceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO};

    if (!device->idle
        && !VK(error, device->vk.vkCreateFence(device->handle, &info, NULL, &device->idle)))
        return false;
    // That of an interrupted wait is older than what the queue has got since.
    if (!finish_idle(device, error))
        return false;
    device->idle_pending =
        VK(error, device->vk.vkQueueSubmit(device->queue, 0, NULL, device->idle));
    // By the specification, no fence tells whether presentations have waited for their semaphores.
    // In drivers they are over with the fence, so that this wait without a limit is short.
    const bool done = device->idle_pending && finish_idle(device, error)
                   && VK(error, device->vk.vkQueueWaitIdle(device->queue));
    return remember_loss(device, done, error);
}

bool vkb_timeline_export(const struct vkb_device *device, VkSemaphore *semaphore, int *descriptor,
                         struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &device->vk;
    const VkExportSemaphoreCreateInfo exported = {
        .sType = VK_STRUCTURE_TYPE_EXPORT_SEMAPHORE_CREATE_INFO,
        .handleTypes = VK_EXTERNAL_SEMAPHORE_HANDLE_TYPE_OPAQUE_FD_BIT,
    };
    const VkSemaphoreTypeCreateInfo timeline = {
        .sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO,
        .pNext = &exported,
        .semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE,
    };

    *semaphore = VK_NULL_HANDLE;
    if (VK(error, vk->vkCreateSemaphore(device->handle,
                                        &(VkSemaphoreCreateInfo){
                                            .sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO,
                                            .pNext = &timeline,
                                        },
                                        NULL, semaphore))
        && VK(error, vk->vkGetSemaphoreFdKHR(
                         device->handle,
                         &(VkSemaphoreGetFdInfoKHR){
                             .sType = VK_STRUCTURE_TYPE_SEMAPHORE_GET_FD_INFO_KHR,
                             .semaphore = *semaphore,
                             .handleType = VK_EXTERNAL_SEMAPHORE_HANDLE_TYPE_OPAQUE_FD_BIT,
                         },
                         descriptor)))
        return true;
    vk->vkDestroySemaphore(device->handle, *semaphore, NULL);
    *semaphore = VK_NULL_HANDLE;
    return false;
}
