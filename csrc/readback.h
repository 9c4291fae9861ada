// Images back to the host: copied to staging memory by the device, from there to the caller.
#ifndef VKB_READBACK_H
#define VKB_READBACK_H

#include "memory.h"

// One image wanted on the host: tightly packed rows, top row first, the first `channels` channels
// of each pixel.
struct vkb_output {
    uint32_t image;  // in the graph
    uint32_t channels;
    void *memory;
    // What vkb_readback_record leaves for vkb_readback_fetch.
    VkDeviceSize offset;
    enum vkb_format format;
    size_t pixels;
};

struct vkb_readback {
    struct vkb_buffer staging;
    VkDeviceSize used;
};

void vkb_readback_destroy(const struct vkb_device *device, struct vkb_readback *readback);

// Makes room for images of `size` bytes in all (by vkb_readback_size) and forgets the last copies.
bool vkb_readback_begin(const struct vkb_device *device, struct vkb_readback *readback,
                        VkDeviceSize size, struct vkb_error *error);
VkDeviceSize vkb_readback_size(enum vkb_format format, uint32_t width, uint32_t height);

// Records the copy of the output's image.
void vkb_readback_record(const struct vkb_device *device, VkCommandBuffer commands,
                         struct vkb_readback *readback, struct vkb_image *image,
                         struct vkb_output *output);

// To be called once the device is done, before the first fetch.
bool vkb_readback_end(const struct vkb_device *device, const struct vkb_readback *readback,
                      struct vkb_error *error);

// The pixels to the caller's memory, whatever
// has become of the image since.
void vkb_readback_fetch(const struct vkb_readback *readback, const struct vkb_output *output);

#endif
