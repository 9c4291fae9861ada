// Every failure is a value: functions return false after filling a struct vkb_error.
#ifndef VKB_ERROR_H
#define VKB_ERROR_H

#include <stdbool.h>
#include <stddef.h>
#include <vulkan/vulkan_core.h>

enum vkb_error_kind {
    VKB_OK,
    VKB_ERROR_GENERAL,
    VKB_ERROR_ADAPTER_NOT_FOUND,
    VKB_ERROR_DEVICE_LOST,
    VKB_ERROR_OUT_OF_MEMORY,
    VKB_ERROR_VALIDATION,
    VKB_ERROR_SHADER,
    VKB_ERROR_VALUE,
    VKB_ERROR_INTERRUPTED,  // device->interrupted ended a wait
};

struct vkb_error {
    enum vkb_error_kind kind;
    VkResult result;  // of the Vulkan call; VK_SUCCESS if no Vulkan call failed
    char call[64];    // the Vulkan call that failed, or ""
    char message[2048];
};

// Fills `error` and returns false, so that a caller can `return vkb_fail(...)`.
__attribute__((format(printf, 3, 4))) bool
vkb_fail(struct vkb_error *error, enum vkb_error_kind kind, const char *format, ...);

// Adds to the message, as far as there is space.
__attribute__((format(printf, 2, 3))) void vkb_add_words(struct vkb_error *error,
                                                         const char *format, ...);

// The function's name in the text of a call, for example "vkCreateImage" in
// "device->vk.vkCreateImage(...)", and its length.
const char *vkb_call_name(const char *call_text, size_t *length);

// True if `result` is VK_SUCCESS. Otherwise fills `error` from the result and the text of the call.
bool vkb_check(struct vkb_error *error, VkResult result, const char *call_text);

// The core calls every Vulkan function that can fail through one of these. The second one returns
// the VkResult.
#define VK(error, call) vkb_check((error), VK_RESULT(call), #call)
#ifdef VKBLOOM_FAULTS
#include "vulkan/faults.h"
#define VK_RESULT(call) (vkb_fault(#call) ? vkb_fault_result : (call))
#else
#define VK_RESULT(call) (call)
#endif

// Allocates zeroed host memory for `count` objects of `size` bytes; NULL and a filled error on
// failure.
void *vkb_alloc(struct vkb_error *error, size_t count, size_t size);
// Grows an array to at least `needed` objects of `size` bytes. On failure the array is unchanged.
// `array` points to the pointer to the first object, of any type.
bool vkb_grow(struct vkb_error *error, void *array, size_t *capacity, size_t needed, size_t size);
// Adds a zeroed object of `size` bytes to an array of pointers to such objects. `pointers` points
// to the pointer to the first of them. NULL and a filled error on failure.
void *vkb_append(struct vkb_error *error, void *pointers, size_t *count, size_t *capacity,
                 size_t size);
void vkb_free(void *memory);

// Gives memory that was freed, here or by a driver of CPUs, back to the system, where the C library
// would keep it: the pipelines of all presets take lavapipe 0.45 GiB in blocks of all sizes.
void vkb_return_freed(void);

// What takes less memory.
extern const char vkb_memory_hint[];

// Fails if the process gets no `mib` MiB of address space more (ulimit -v), which `what` needs.
// Drivers that run out of it inside a call crash instead of reporting it.
bool vkb_require_room(const char *what, size_t mib, struct vkb_error *error);
bool vkb_has_room(size_t mib);
// The failure of the first.
bool vkb_fail_room(const char *what, size_t mib, struct vkb_error *error);

#endif
