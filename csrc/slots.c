#include "slots.h"

#include <string.h>

static void destroy_framebuffer(const struct vkb_device *device, struct vkb_slot *slot)
{
    device->vk.vkDestroyFramebuffer(device->handle, slot->framebuffer, NULL);
    slot->framebuffer = VK_NULL_HANDLE;
}

void vkb_slots_destroy(const struct vkb_device *device, struct vkb_slots *slots)
{
    for (size_t i = 0; i < slots->count; ++i) {
        struct vkb_slot *slot = slots->slots[i];
        destroy_framebuffer(device, slot);
        vkb_image_destroy(device, &slot->image);
        vkb_free(slot->recipe);
        vkb_free(slot);
    }
    vkb_free(slots->slots);
    // The clock goes on: nothing made later may be taken for something made before.
    *slots = (struct vkb_slots){.clock = slots->clock};
}

static VkImageUsageFlags image_usage(enum vkb_format format)
{
    return VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT
         | VK_IMAGE_USAGE_SAMPLED_BIT
         | (format == VKB_FORMAT_DEPTH32_FLOAT
                ? VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT
                : VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_STORAGE_BIT);
}

static bool check_format(const struct vkb_device *device, enum vkb_format format,
                         struct vkb_error *error)
{
    const VkFormatFeatureFlags features = format == VKB_FORMAT_DEPTH32_FLOAT
                                            ? VK_FORMAT_FEATURE_DEPTH_STENCIL_ATTACHMENT_BIT
                                            : VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BLEND_BIT
                                                  | VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT
                                                  | VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT;

    if (vkb_device_supports(device, vkb_formats[format].vk, features))
        return true;
    return vkb_fail(error, VKB_ERROR_GENERAL, "the adapter %s cannot render to %s images",
                    device->adapter.name, vkb_formats[format].name);
}

static struct vkb_slot *find_slot(const struct vkb_slots *slots, const char *name)
{
    for (size_t i = 0; i < slots->count; ++i)
        if (strcmp(slots->slots[i]->name, name) == 0)
            return slots->slots[i];
    return NULL;
}

static struct vkb_slot *add_slot(struct vkb_slots *slots, const char *name, struct vkb_error *error)
{
    struct vkb_slot *slot;

    if (!vkb_grow(error, (void **)&slots->slots, &slots->capacity, slots->count + 1,
                  sizeof(struct vkb_slot *))
        || !(slot = vkb_alloc(error, 1, sizeof *slot)))
        return NULL;
    memcpy(slot->name, name, sizeof slot->name);
    slots->slots[slots->count++] = slot;
    return slot;
}

static bool fits(const struct vkb_slot *slot, const struct vkb_image_row *row)
{
    return slot->image.handle && slot->image.format == row->format
        && slot->image.width == row->width && slot->image.height == row->height;
}

struct vkb_slot *vkb_slots_find(const struct vkb_slots *slots, const struct vkb_image_row *row)
{
    struct vkb_slot *slot = find_slot(slots, row->name);

    return slot && fits(slot, row) ? slot : NULL;
}

bool vkb_slots_resolve(const struct vkb_device *device, struct vkb_slots *slots,
                       const struct vkb_image_row *row, struct vkb_slot **resolved,
                       struct vkb_error *error)
{
    struct vkb_slot *slot = find_slot(slots, row->name);

    if (!slot && !(slot = add_slot(slots, row->name, error)))
        return false;
    *resolved = slot;
    if (fits(slot, row))
        return true;
    slot->valid = false;
    slot->image_id = ++slots->clock;
    destroy_framebuffer(device, slot);
    vkb_image_destroy(device, &slot->image);
    return check_format(device, row->format, error)
        && vkb_image_create(device,
                            &(struct vkb_image_spec){
                                .format = row->format,
                                .width = row->width,
                                .height = row->height,
                                .layers = 1,
                                .levels = 1,
                                .usage = image_usage(row->format),
                            },
                            &slot->image, error);
}

bool vkb_slot_up_to_date(const struct vkb_slot *slot, const void *recipe, size_t size)
{
    return slot->valid && slot->recipe_size == size && memcmp(slot->recipe, recipe, size) == 0;
}

bool vkb_slot_begin_writing(struct vkb_slots *slots, struct vkb_slot *slot, const void *recipe,
                            size_t size, struct vkb_error *error)
{
    slot->valid = false;
    slot->version = ++slots->clock;
    if (!vkb_grow(error, (void **)&slot->recipe, &slot->recipe_capacity, size, 1))
        return false;
    if (size)
        memcpy(slot->recipe, recipe, size);
    slot->recipe_size = size;
    return true;
}

bool vkb_slot_framebuffer(const struct vkb_device *device, struct vkb_slot **targets,
                          uint32_t target_count, VkRenderPass render_pass,
                          VkFramebuffer *framebuffer, struct vkb_error *error)
{
    struct vkb_slot *first = targets[0];
    VkImageView views[VKB_MAX_TARGETS + 1];
    uint64_t images[VKB_MAX_TARGETS + 1] = {0};

    for (uint32_t i = 0; i < target_count; ++i) {
        views[i] = targets[i]->image.view;
        images[i] = targets[i]->image_id;
    }
    if (!first->framebuffer || first->framebuffer_pass != render_pass
        || memcmp(first->framebuffer_images, images, sizeof images) != 0) {
        destroy_framebuffer(device, first);
        if (!VK(error, device->vk.vkCreateFramebuffer(
                           device->handle,
                           &(VkFramebufferCreateInfo){
                               .sType = VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO,
                               .renderPass = render_pass,
                               .attachmentCount = target_count,
                               .pAttachments = views,
                               .width = first->image.width,
                               .height = first->image.height,
                               .layers = 1,
                           },
                           NULL, &first->framebuffer)))
            return false;
        first->framebuffer_pass = render_pass;
        memcpy(first->framebuffer_images, images, sizeof images);
    }
    *framebuffer = first->framebuffer;
    return true;
}
