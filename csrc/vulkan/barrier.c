#include "vulkan/barrier.h"

#define STAGE(name)  VK_PIPELINE_STAGE_##name##_BIT
#define ACCESS(name) VK_ACCESS_##name##_BIT
#define LAYOUT(name) VK_IMAGE_LAYOUT_##name
#define USAGE(name)  VK_IMAGE_USAGE_##name##_BIT
#define ALL_SHADERS  (STAGE(FRAGMENT_SHADER) | STAGE(COMPUTE_SHADER) | STAGE(TRANSFER))
#define DEPTH_STAGES (STAGE(EARLY_FRAGMENT_TESTS) | STAGE(LATE_FRAGMENT_TESTS))

static const struct access_info {
    VkPipelineStageFlags stages;
    VkAccessFlags reads, writes;
    VkImageLayout layout;
    VkImageUsageFlags usage;  // that an image must have
} accesses[VKB_ACCESS_COUNT] = {
    [VKB_ACCESS_NONE] = {STAGE(TOP_OF_PIPE), 0, 0, LAYOUT(UNDEFINED), 0},
    // Blending reads it.
    [VKB_ACCESS_COLOR_TARGET] = {STAGE(COLOR_ATTACHMENT_OUTPUT), ACCESS(COLOR_ATTACHMENT_READ),
                                 ACCESS(COLOR_ATTACHMENT_WRITE), LAYOUT(COLOR_ATTACHMENT_OPTIMAL),
                                 USAGE(COLOR_ATTACHMENT)},
    [VKB_ACCESS_DEPTH_TARGET] = {DEPTH_STAGES, ACCESS(DEPTH_STENCIL_ATTACHMENT_READ),
                                 ACCESS(DEPTH_STENCIL_ATTACHMENT_WRITE),
                                 LAYOUT(DEPTH_STENCIL_ATTACHMENT_OPTIMAL),
                                 USAGE(DEPTH_STENCIL_ATTACHMENT)},
    [VKB_ACCESS_SAMPLED] = {STAGE(FRAGMENT_SHADER), ACCESS(SHADER_READ), 0,
                            LAYOUT(SHADER_READ_ONLY_OPTIMAL), USAGE(SAMPLED)},
    [VKB_ACCESS_DISPATCH_SAMPLED] = {STAGE(COMPUTE_SHADER), ACCESS(SHADER_READ), 0,
                                     LAYOUT(SHADER_READ_ONLY_OPTIMAL), USAGE(SAMPLED)},
    [VKB_ACCESS_DISPATCH_LOADED] = {STAGE(COMPUTE_SHADER), ACCESS(SHADER_READ), 0, LAYOUT(GENERAL),
                                    USAGE(STORAGE)},
    [VKB_ACCESS_DISPATCH_STORED] = {STAGE(COMPUTE_SHADER), 0, ACCESS(SHADER_WRITE), LAYOUT(GENERAL),
                                    USAGE(STORAGE)},
    [VKB_ACCESS_DISPATCH_CHANGED] = {STAGE(COMPUTE_SHADER), ACCESS(SHADER_READ),
                                     ACCESS(SHADER_WRITE), LAYOUT(GENERAL), USAGE(STORAGE)},
    [VKB_ACCESS_RESOURCE] = {ALL_SHADERS, ACCESS(SHADER_READ) | ACCESS(UNIFORM_READ),
                             ACCESS(SHADER_WRITE) | ACCESS(TRANSFER_WRITE), LAYOUT(GENERAL), 0},
    [VKB_ACCESS_COPY_SOURCE] = {STAGE(TRANSFER), ACCESS(TRANSFER_READ), 0,
                                LAYOUT(TRANSFER_SRC_OPTIMAL), USAGE(TRANSFER_SRC)},
    [VKB_ACCESS_COPY_TARGET] = {STAGE(TRANSFER), 0, ACCESS(TRANSFER_WRITE),
                                LAYOUT(TRANSFER_DST_OPTIMAL), USAGE(TRANSFER_DST)},
    [VKB_ACCESS_VERTICES] = {STAGE(VERTEX_INPUT),
                             ACCESS(INDEX_READ) | ACCESS(VERTEX_ATTRIBUTE_READ), 0,
                             LAYOUT(UNDEFINED), 0},
    [VKB_ACCESS_HOST_READ] = {STAGE(HOST), ACCESS(HOST_READ), 0, LAYOUT(UNDEFINED), 0},
    // The stage of the wait for the semaphore, after which the barrier comes.
    [VKB_ACCESS_ACQUIRED] = {STAGE(TRANSFER), 0, 0, LAYOUT(UNDEFINED), 0},
    // The semaphore makes what was written available.
    [VKB_ACCESS_PRESENTED] = {STAGE(BOTTOM_OF_PIPE), 0, 0, LAYOUT(PRESENT_SRC_KHR), 0},
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

void vkb_barrier_record_owner(const struct vkb_device *device, VkCommandBuffer commands,
                              VkBuffer buffer, enum vkb_access from, enum vkb_access to)
{
    const struct access_info *before = &accesses[from], *after = &accesses[to];
    const uint32_t family = device->adapter.queue_family;

    device->vk.vkCmdPipelineBarrier(
        commands, before->stages, after->stages, 0, 0, NULL, 1,
        &(VkBufferMemoryBarrier){
            .sType = VK_STRUCTURE_TYPE_BUFFER_MEMORY_BARRIER,
            .srcAccessMask = before->writes,
            .dstAccessMask = after->reads,
            .srcQueueFamilyIndex = from == VKB_ACCESS_NONE ? VK_QUEUE_FAMILY_EXTERNAL : family,
            .dstQueueFamilyIndex = to == VKB_ACCESS_PRESENTED ? VK_QUEUE_FAMILY_EXTERNAL : family,
            .buffer = buffer,
            .size = VK_WHOLE_SIZE,
        },
        0, NULL);
}
