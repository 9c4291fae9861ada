// Copies of images to the host. The device copies directly to the caller's memory if it can import
// it. Otherwise it copies to staging memory, and the host copies from there.
#ifndef VKB_READBACK_H
#define VKB_READBACK_H

#include "share/exported_memory.h"
#include "transfer/pages.h"
#include "vulkan/image.h"

// The device writes directly to the caller's memory if it has at least this size. On lavapipe
// 22.3.6 (two Zen 3 cores) both ways take the same time up to 256 KiB. Without the host's copy, a
// frame of 1 MiB takes 80 us instead of 102, and one of 16 MiB 1.8 ms instead of 2.7. An import
// costs more on a GPU than on a CPU.
enum { VKB_IMPORTED_BYTES = 1 << 20 };

// How the pixels of an output leave the device.
enum vkb_sink_kind {
    VKB_SINK_NONE,      // they do not
    VKB_SINK_GIVEN,     // the host copies them from the pixels that the graph has
    VKB_SINK_STAGING,   // the device copies to staging memory, and the host from there
    VKB_SINK_PAGES,     // the device copies to the caller's memory, which it has imported
    VKB_SINK_EXPORTED,  // they are copied to memory that CUDA shares (exported.h)
    VKB_SINK_STORED,    // the last pass stores to this memory; set while the passes are recorded
};

// One requested image in host memory: tightly packed rows, top row first, with the first `channels`
// channels of each pixel.
struct vkb_output {
    uint32_t channels;
    uint32_t row_count;
    void *memory;                 // NULL: it stays on the device
    struct vkb_export *exported;  // instead of host memory; NULL: none
    size_t layer_stride;          // there, of a batch
    struct vkb_page_run *pages;   // the run that contains the memory; NULL: none, or a small array
    // Set before the recording (vkb_host_sink).
    enum vkb_format format;
    uint32_t width;
    const struct vkb_image_row *image;
    enum vkb_sink_kind sink;
    VkBuffer imported;  // the caller's memory as a buffer; VK_NULL_HANDLE: it is none
    VkDeviceSize imported_offset;
    VkDeviceSize offset;  // in the staging memory
};

struct vkb_readback {
    struct vkb_buffer staging;
    VkDeviceSize used;           // bytes of the staging memory
    struct vkb_buffer *imports;  // of the callers' memory, until vkb_readback_release
    size_t import_count, import_capacity;
    struct vkb_buffer counts;  // of NaN and infinity of each request, where CUDA shares memory
    bool counted;
    uint64_t counted_version;  // of the content of one image that they are of; 0: it is none
};

void vkb_readback_destroy(const struct vkb_device *device, struct vkb_readback *readback);

// Whether the output has all channels of its image.
bool vkb_readback_is_complete(const struct vkb_output *output);
// Whether a pass can store words to the output's memory.
bool vkb_readback_takes_linear_texels(const struct vkb_device *device,
                                      const struct vkb_output *output);
// Records the copy of the output's rows of an image to a buffer.
void vkb_readback_copy(const struct vkb_device *device, VkCommandBuffer commands,
                       struct vkb_image *image, const struct vkb_output *output, VkBuffer to,
                       VkDeviceSize offset);

// Call when the device has finished, before the first fetch.
bool vkb_readback_end(const struct vkb_device *device, const struct vkb_readback *readback,
                      struct vkb_error *error);

// Gives the caller the pixels that are not in its memory yet. The image is no longer needed.
void vkb_readback_fetch(const struct vkb_device *device, const struct vkb_readback *readback,
                        const struct vkb_output *output);

// Destroys the imported buffers and discards the plan. The device must have finished.
void vkb_readback_release(const struct vkb_device *device, struct vkb_readback *readback);

#endif
