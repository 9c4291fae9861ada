// Images, each with its own memory. Those that the host maps are buffers, too.
#ifndef VKB_VULKAN_IMAGE_H
#define VKB_VULKAN_IMAGE_H

#include "vulkan/barrier.h"
#include "vulkan/format.h"
#include "vulkan/memory.h"

struct vkb_image {
    VkImage handle;
    VkDeviceMemory memory;
    void *host;  // what was allocated for memory of the host's; NULL: the device's
    VkDeviceSize memory_size;
    uint32_t memory_type;
    VkImageView view;  // of all levels
    enum vkb_format format;
    uint32_t width, height, depth, layers, levels;
    VkImageUsageFlags usage;
    bool array;              // its view is of an array, also of six layers
    bool hosted;             // its memory may be imported
    enum vkb_access access;  // the last access recorded
    void *mapped;            // its pixels, row by row; NULL: not host-visible
    size_t row_pitch;        // of the mapped pixels, in bytes
    uint32_t channels;       // of the mapped pixels; those of the caller may lack the fourth
    // The mapped pixels as a buffer, and as linear texels.
    VkBuffer buffer;
    VkBufferView linear_texels;  // created at its first use
};

// Without numbers of layers and levels there is one. Six layers make a cubemap, unless it is an
// array. A mapped image has one layer and one level, and
// its memory is also a buffer; this requires device->linear_texels.
struct vkb_image_spec {
    enum vkb_format format;
    uint32_t width, height, layers, levels;
    VkImageUsageFlags usage;
    bool mapped, array;
    // Of mapped images: may be in memory of the host's, so that the host cannot write it before the
    // device does.
    bool hosted;
    // Of colour images of other formats, whose `format` is NONE: 1 to 3 dimensions, and the third.
    VkFormat other;
    uint32_t dimensions, depth;
    struct vkb_spares *spares;  // what its memory is taken from, if one fits; NULL: none
};

// On failure nothing leaks. Destroying a zeroed or half-created image is safe.
bool vkb_image_create(const struct vkb_device *device, const struct vkb_image_spec *spec,
                      struct vkb_image *image, struct vkb_error *error);
void vkb_image_destroy(const struct vkb_device *device, struct vkb_image *image);
// The same, but its memory is left to new images. `used`: the last submission that used it.
void vkb_image_spare(const struct vkb_device *device, struct vkb_image *image, uint64_t used,
                     struct vkb_spares *spares);

// Makes a mapped image over the caller's memory, whose words passes can read, and nothing else. The
// image has its format, size, channels, row pitch and memory; its rows have `row_size` bytes. Both
// are multiples of VKB_WORD_SIZE. False without an error if the device cannot do this.
bool vkb_image_borrow(const struct vkb_device *device, size_t row_size, struct vkb_image *image);

// Creates the view of a mapped image's linear texels if there is none. The image must be small
// enough (see vkb_image_fits_linear_texels).
bool vkb_image_linear_texels(const struct vkb_device *device, struct vkb_image *image,
                             struct vkb_error *error);

// An upper bound of the bytes from a row of a mapped image to the next.
size_t vkb_image_row_pitch(enum vkb_format format, uint32_t width);

// Whether an image of that size is small enough for a view of its linear texels.
bool vkb_image_fits_linear_texels(const struct vkb_device *device, enum vkb_format format,
                                  uint32_t width, uint32_t height);

// The layout of the image for that access. A mapped image is always in the general layout.
VkImageLayout vkb_image_layout(const struct vkb_image *image, enum vkb_access access);

// Records the copy of all pixels, without gaps, to the only level of an image with one layer.
void vkb_image_fill(const struct vkb_device *device, VkCommandBuffer commands,
                    struct vkb_image *image, VkBuffer from, VkDeviceSize offset);

// Records the barrier between the image's last access and `access`.
void vkb_image_transition(const struct vkb_device *device, VkCommandBuffer commands,
                          struct vkb_image *image, enum vkb_access access);

#endif
