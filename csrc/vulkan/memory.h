// Memory of the device and of the host, and buffers, each with its own.
#ifndef VKB_MEMORY_H
#define VKB_MEMORY_H

#include "vulkan/device.h"
#include "vulkan/spares.h"

enum vkb_memory_kind {
    VKB_MEMORY_DEVICE,    // fast for the device
    VKB_MEMORY_UPLOAD,    // mapped; the host writes
    VKB_MEMORY_READBACK,  // mapped and cached; the host reads
    VKB_MEMORY_SHARED,    // mapped and coherent; for images, on devices whose memory is the host's
};

// Allocations of at least this size use the system's large pages, so that fewer pages are mapped,
// zeroed, pinned and looked up.
#define VKB_LARGE_BYTES ((size_t)4 << 20)
#define VKB_SMALL_PAGE  ((size_t)4096)

// The type of memory of the host that is imported.
#define VKB_HOST_ALLOCATION VK_EXTERNAL_MEMORY_HANDLE_TYPE_HOST_ALLOCATION_BIT_EXT

struct vkb_buffer {
    VkBuffer handle;
    VkDeviceMemory memory;
    void *host;  // what was allocated for memory of the host's; NULL: the device's
    VkDeviceSize size;
    void *mapped;  // NULL for VKB_MEMORY_DEVICE
    bool coherent;
};

// Allocates memory of whole pages, which are large ones from VKB_LARGE_BYTES on: at *start is what
// is to be freed. Devices can import it. `device` may be NULL.
void *vkb_alloc_pages(const struct vkb_device *device, size_t size, void **start,
                      struct vkb_error *error);
// The bytes of these pages.
size_t vkb_size_of_pages(const struct vkb_device *device, size_t size);

// Advises the system to use large pages for memory that has not been written yet.
void vkb_advise_large(void *memory, size_t size);

// Allocates memory of a kind that fits the requirements, or takes it from the spares. `next`: what
// extends VkMemoryAllocateInfo. `hosted`: the host's, if possible.
bool vkb_memory_allocate(const struct vkb_device *device, enum vkb_memory_kind kind,
                         const VkMemoryRequirements *requirements, const void *next, bool hosted,
                         struct vkb_spares *spares, struct vkb_spare *made,
                         struct vkb_error *error);

// Creates the handle of a buffer, whose memory has that external type; 0: none.
bool vkb_buffer_create_handle(const struct vkb_device *device, VkBufferUsageFlags usage,
                              VkDeviceSize size, VkExternalMemoryHandleTypeFlags type,
                              VkBuffer *buffer, struct vkb_error *error);

// On failure nothing leaks. Destroying a zeroed or half-created object is safe.
bool vkb_buffer_create(const struct vkb_device *device, enum vkb_memory_kind kind,
                       VkBufferUsageFlags usage, VkDeviceSize size, struct vkb_buffer *buffer,
                       struct vkb_error *error);

// Creates a buffer whose memory other interfaces of the same GPU can import. *descriptor is a new
// descriptor of the memory, which belongs to the caller. buffer->size is that of the memory. Needs
// device->exports.
bool vkb_buffer_export(const struct vkb_device *device, VkDeviceSize size,
                       struct vkb_buffer *buffer, int *descriptor, struct vkb_error *error);

void vkb_buffer_destroy(const struct vkb_device *device, struct vkb_buffer *buffer);

// Makes the buffer at least `size` bytes large. If it grows, its content is lost.
bool vkb_buffer_reserve(const struct vkb_device *device, enum vkb_memory_kind kind,
                        VkBufferUsageFlags usage, VkDeviceSize size, struct vkb_buffer *buffer,
                        struct vkb_error *error);

// Creates a buffer over host memory of the caller, which the device writes without a copy. The
// buffer starts at the multiple of device->import_alignment at or before `memory`; *offset is the
// offset of `memory` in it. False without an error if the device cannot import this memory.
bool vkb_buffer_import(const struct vkb_device *device, VkBufferUsageFlags usage, void *memory,
                       size_t size, struct vkb_buffer *buffer, VkDeviceSize *offset);

// For mapped memory that is not coherent: after the host has written, and before it reads.
bool vkb_buffer_flush(const struct vkb_device *device, const struct vkb_buffer *buffer,
                      struct vkb_error *error);
bool vkb_buffer_invalidate(const struct vkb_device *device, const struct vkb_buffer *buffer,
                           struct vkb_error *error);

#endif
