#include "vulkan/barrier.h"

#include <string.h>

#define DEPTH_STAGES \
    (VK_PIPELINE_STAGE_EARLY_FRAGMENT_TESTS_BIT | VK_PIPELINE_STAGE_LATE_FRAGMENT_TESTS_BIT)

static const struct access_info {
    VkPipelineStageFlags stages;
    VkAccessFlags reads, writes;
    VkImageLayout layout;
    VkImageUsageFlags usage;  // that an image must have
    bool attachment;          // accesses only the pixel's own position
} accesses[VKB_ACCESS_COUNT] = {
    [VKB_ACCESS_NONE] =
        {
            .stages = VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT,
            .layout = VK_IMAGE_LAYOUT_UNDEFINED,
        },
    [VKB_ACCESS_COLOR_TARGET] =
        {
            .stages = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT,
            .writes = VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT,
            .layout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL,
            .usage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT,
            .attachment = true,
        },
    [VKB_ACCESS_COLOR_BLEND] =
        {
            .stages = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT,
            .reads = VK_ACCESS_COLOR_ATTACHMENT_READ_BIT,
            .writes = VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT,
            .layout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL,
            .usage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT,
            .attachment = true,
        },
    [VKB_ACCESS_DEPTH_TARGET] =
        {
            .stages = DEPTH_STAGES,
            .reads = VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_READ_BIT,
            .writes = VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT,
            .layout = VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
            .usage = VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT,
            .attachment = true,
        },
    [VKB_ACCESS_SAMPLED] =
        {
            .stages = VK_PIPELINE_STAGE_FRAGMENT_SHADER_BIT,
            .reads = VK_ACCESS_SHADER_READ_BIT,
            .layout = VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL,
            .usage = VK_IMAGE_USAGE_SAMPLED_BIT,
        },
    [VKB_ACCESS_DISPATCH_SAMPLED] =
        {
            .stages = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
            .reads = VK_ACCESS_SHADER_READ_BIT,
            .layout = VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL,
            .usage = VK_IMAGE_USAGE_SAMPLED_BIT,
        },
    [VKB_ACCESS_DISPATCH_LOADED] =
        {
            .stages = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
            .reads = VK_ACCESS_SHADER_READ_BIT,
            .layout = VK_IMAGE_LAYOUT_GENERAL,
            .usage = VK_IMAGE_USAGE_STORAGE_BIT,
        },
    [VKB_ACCESS_DISPATCH_STORED] =
        {
            .stages = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
            .writes = VK_ACCESS_SHADER_WRITE_BIT,
            .layout = VK_IMAGE_LAYOUT_GENERAL,
            .usage = VK_IMAGE_USAGE_STORAGE_BIT,
        },
    [VKB_ACCESS_DISPATCH_CHANGED] =
        {
            .stages = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
            .reads = VK_ACCESS_SHADER_READ_BIT,
            .writes = VK_ACCESS_SHADER_WRITE_BIT,
            .layout = VK_IMAGE_LAYOUT_GENERAL,
            .usage = VK_IMAGE_USAGE_STORAGE_BIT,
        },
    [VKB_ACCESS_ANY_READ] =
        {
            .stages = VK_PIPELINE_STAGE_FRAGMENT_SHADER_BIT | VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT
                    | VK_PIPELINE_STAGE_TRANSFER_BIT,
            .reads = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_TRANSFER_READ_BIT,
            .layout = VK_IMAGE_LAYOUT_GENERAL,
        },
    [VKB_ACCESS_RESOURCE] =
        {
            .stages = VK_PIPELINE_STAGE_FRAGMENT_SHADER_BIT | VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT
                    | VK_PIPELINE_STAGE_TRANSFER_BIT,
            .reads = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_UNIFORM_READ_BIT,
            .writes = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT,
            .layout = VK_IMAGE_LAYOUT_GENERAL,
        },
    [VKB_ACCESS_COPY_SOURCE] =
        {
            .stages = VK_PIPELINE_STAGE_TRANSFER_BIT,
            .reads = VK_ACCESS_TRANSFER_READ_BIT,
            .layout = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL,
            .usage = VK_IMAGE_USAGE_TRANSFER_SRC_BIT,
        },
    [VKB_ACCESS_COPY_TARGET] =
        {
            .stages = VK_PIPELINE_STAGE_TRANSFER_BIT,
            .writes = VK_ACCESS_TRANSFER_WRITE_BIT,
            .layout = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
            .usage = VK_IMAGE_USAGE_TRANSFER_DST_BIT,
        },
    // The stage of the wait for the semaphore, after which the barrier comes.
    [VKB_ACCESS_ACQUIRED] =
        {
            .stages = VK_PIPELINE_STAGE_TRANSFER_BIT,
            .layout = VK_IMAGE_LAYOUT_UNDEFINED,
        },
    // The semaphore makes what was written available.
    [VKB_ACCESS_PRESENTED] =
        {
            .stages = VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT,
            .layout = VK_IMAGE_LAYOUT_PRESENT_SRC_KHR,
        },
};

VkImageLayout vkb_access_layout(enum vkb_access access)
{
    return accesses[access].layout;
}

VkImageUsageFlags vkb_access_usage(enum vkb_access access)
{
    return accesses[access].usage;
}

VkPipelineStageFlags vkb_access_stages(enum vkb_access access)
{
    return accesses[access].stages;
}

void vkb_barrier_record(const struct vkb_device *device, VkCommandBuffer commands,
                        const VkImageMemoryBarrier *image, bool memory, enum vkb_access from,
                        enum vkb_access to)
{
    const struct access_info *before = &accesses[from], *after = &accesses[to];
    const VkMemoryBarrier all = {
        .sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER,
        .srcAccessMask = before->writes,
        .dstAccessMask = after->reads | after->writes,
    };
    VkImageMemoryBarrier barrier;

    if (from == to && !after->writes)
        return;
    if (image) {
        barrier = *image;
        barrier.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER;
        barrier.srcAccessMask = all.srcAccessMask;
        barrier.dstAccessMask = all.dstAccessMask;
        barrier.srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
        barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    }
    device->vk.vkCmdPipelineBarrier(commands, before->stages, after->stages, 0, memory, &all, 0,
                                    NULL, image != NULL, &barrier);
}

// After copies to buffers, and after the writes of `also`.
static void record_buffer_barrier(const struct vkb_device *device, VkCommandBuffer commands,
                                  enum vkb_access also, VkPipelineStageFlags stages,
                                  VkAccessFlags reads)
{
    const struct access_info *copy = &accesses[VKB_ACCESS_COPY_TARGET], *other = &accesses[also];

    device->vk.vkCmdPipelineBarrier(commands, copy->stages | other->stages, stages, 0, 1,
                                    &(VkMemoryBarrier){
                                        .sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER,
                                        .srcAccessMask = copy->writes | other->writes,
                                        .dstAccessMask = reads,
                                    },
                                    0, NULL, 0, NULL);
}

void vkb_barrier_record_host_read(const struct vkb_device *device, VkCommandBuffer commands)
{
    record_buffer_barrier(device, commands, VKB_ACCESS_DISPATCH_STORED, VK_PIPELINE_STAGE_HOST_BIT,
                          VK_ACCESS_HOST_READ_BIT);
}

// Another owner is outside of Vulkan.
static void record_owner(const struct vkb_device *device, VkCommandBuffer commands,
                         VkPipelineStageFlags from, VkPipelineStageFlags to,
                         const VkBufferMemoryBarrier *given)
{
    VkBufferMemoryBarrier barrier = *given;

    barrier.sType = VK_STRUCTURE_TYPE_BUFFER_MEMORY_BARRIER;
    barrier.size = VK_WHOLE_SIZE;
    device->vk.vkCmdPipelineBarrier(commands, from, to, 0, 0, NULL, 1, &barrier, 0, NULL);
}

void vkb_barrier_record_acquire(const struct vkb_device *device, VkCommandBuffer commands,
                                VkBuffer buffer)
{
    const struct access_info *copy = &accesses[VKB_ACCESS_COPY_SOURCE],
                             *loaded = &accesses[VKB_ACCESS_DISPATCH_LOADED];

    record_owner(device, commands, accesses[VKB_ACCESS_NONE].stages, copy->stages | loaded->stages,
                 &(VkBufferMemoryBarrier){
                     .dstAccessMask = copy->reads | loaded->reads,
                     .srcQueueFamilyIndex = VK_QUEUE_FAMILY_EXTERNAL,
                     .dstQueueFamilyIndex = device->adapter.queue_family,
                     .buffer = buffer,
                 });
}

void vkb_barrier_record_release(const struct vkb_device *device, VkCommandBuffer commands,
                                VkBuffer buffer, enum vkb_access from)
{
    record_owner(device, commands, accesses[from].stages, accesses[VKB_ACCESS_PRESENTED].stages,
                 &(VkBufferMemoryBarrier){
                     .srcAccessMask = accesses[from].writes,
                     .srcQueueFamilyIndex = device->adapter.queue_family,
                     .dstQueueFamilyIndex = VK_QUEUE_FAMILY_EXTERNAL,
                     .buffer = buffer,
                 });
}

void vkb_barrier_record_upload(const struct vkb_device *device, VkCommandBuffer commands)
{
    record_buffer_barrier(device, commands, VKB_ACCESS_COPY_TARGET,
                          VK_PIPELINE_STAGE_VERTEX_INPUT_BIT,
                          VK_ACCESS_INDEX_READ_BIT | VK_ACCESS_VERTEX_ATTRIBUTE_READ_BIT);
}

static uint32_t add_dependency(VkSubpassDependency *dependencies, uint32_t count,
                               uint32_t from_subpass, enum vkb_access from, uint32_t to_subpass,
                               enum vkb_access to)
{
    const struct access_info *before = &accesses[from], *after = &accesses[to];
    VkSubpassDependency added = {
        .srcSubpass = from_subpass,
        .dstSubpass = to_subpass,
        .srcStageMask = before->stages,
        .dstStageMask = after->stages,
        // Reads need no availability operation; their access mask only documents the dependency.
        .srcAccessMask = before->writes ? before->writes : before->reads,
        .dstAccessMask = after->reads | after->writes,
        // By region only between attachments. A blur reads neighbouring pixels, so a pixel of the
        // next pass depends on pixels at other positions.
        .dependencyFlags =
            before->attachment && after->attachment ? VK_DEPENDENCY_BY_REGION_BIT : 0,
    };

    for (uint32_t i = 0; i < count; ++i)
        if (memcmp(&dependencies[i], &added, sizeof added) == 0)
            return count;
    dependencies[count] = added;
    return count + 1;
}

uint32_t vkb_subpass_dependencies(const struct vkb_target_use *uses, uint32_t use_count,
                                  VkSubpassDependency *dependencies)
{
    uint32_t count = 0;

    for (uint32_t i = 0; i < use_count; ++i)
        count = add_dependency(dependencies, count, VK_SUBPASS_EXTERNAL, uses[i].before, 0,
                               uses[i].during);
    for (uint32_t i = 0; i < use_count; ++i)
        if (uses[i].after != VKB_ACCESS_NONE)
            count = add_dependency(dependencies, count, 0, uses[i].during, VK_SUBPASS_EXTERNAL,
                                   uses[i].after);
    return count;
}
