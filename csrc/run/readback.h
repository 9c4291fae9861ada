// Images back to the host: copied by the device straight to the caller's memory where it can have
// that, else to staging memory and by the host from there.
#ifndef VKB_READBACK_H
#define VKB_READBACK_H

#include "run/pages.h"

// From so many bytes on the device writes to the caller's memory itself. On lavapipe 22.3.6 (two
// Zen 3 cores) both ways take the same time up to 256 KiB, and without the host's copy a frame of
// 1 MiB takes 80 us instead of 102, one of 16 MiB 1.8 ms instead of 2.7. A GPU pays more for each
// import than a CPU does.
enum { VKB_IMPORTED_BYTES = 1 << 20 };

// One image wanted on the host: tightly packed rows, top row first, the first `channels` channels
// of each pixel.
struct vkb_output {
    uint32_t channels;
    uint32_t first_row, row_count;  // of the image
    void *memory;                   // NULL: it stays on the device
    struct vkb_page_run
        *pages;  // that the memory is in; NULL: none of the renderer's, or too little
    // What vkb_readback_plan decides.
    enum vkb_format format;
    uint32_t width;
    VkBuffer imported;    // the caller's memory as a buffer; VK_NULL_HANDLE: through the staging
    VkDeviceSize offset;  // in either
    // Decided while its passes are recorded: the last of them stores to the imported memory, so
    // there is no copy.
    bool stored;
};

struct vkb_readback {
    struct vkb_buffer staging;
    VkDeviceSize used;           // of the staging memory
    struct vkb_buffer *imports;  // of the callers' memory, until vkb_readback_release
    size_t import_count, import_capacity;
};

void vkb_readback_destroy(const struct vkb_device *device, struct vkb_readback *readback);

// Decides how the output, rows of an image of that format and width, comes back.
bool vkb_readback_plan(const struct vkb_device *device, struct vkb_readback *readback,
                       enum vkb_format format, uint32_t width, struct vkb_output *output,
                       struct vkb_error *error);
// Whether a pass can store words to the output's memory, all rows of an image of that height.
bool vkb_readback_takes_words(const struct vkb_device *device, const struct vkb_output *output,
                              uint32_t height);
// After all of them: makes room for what goes through the staging memory.
bool vkb_readback_reserve(const struct vkb_device *device, struct vkb_readback *readback,
                          struct vkb_error *error);

// Records the copy of the output's image, unless a pass stored it.
void vkb_readback_record(const struct vkb_device *device, VkCommandBuffer commands,
                         const struct vkb_readback *readback, struct vkb_image *image,
                         const struct vkb_output *output);

// Once the device is done, before the first fetch.
bool vkb_readback_end(const struct vkb_device *device, const struct vkb_readback *readback,
                      struct vkb_error *error);

// The pixels to the caller's memory, whatever has become of the image since.
void vkb_readback_fetch(const struct vkb_readback *readback, const struct vkb_output *output);

// Lets go of the callers' memory and forgets what was planned; the device must be done.
void vkb_readback_release(const struct vkb_device *device, struct vkb_readback *readback);

#endif
