// mmap is no part of C11.
#define _DEFAULT_SOURCE
#include "vulkan/error.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#ifdef __linux__
#include <sys/mman.h>
#endif

const char vkb_memory_hint[] =
    "Smaller bloom buffers (bloom_scale), half floats or fewer framebuffers need less";

bool vkb_fail(struct vkb_error *error, enum vkb_error_kind kind, const char *format, ...)
{
    va_list arguments;

    *error = (struct vkb_error){.kind = kind};
    va_start(arguments, format);
    vsnprintf(error->message, sizeof error->message, format, arguments);
    va_end(arguments);
    return false;
}

void vkb_add_words(struct vkb_error *error, const char *format, ...)
{
    const size_t length = strlen(error->message);
    va_list arguments;

    va_start(arguments, format);
    vsnprintf(error->message + length, sizeof error->message - length, format, arguments);
    va_end(arguments);
}

#define RESULT(name, kind) {name, #name, VKB_ERROR_##kind}

static const struct result_info {
    VkResult result;
    const char *name;
    enum vkb_error_kind kind;
} results[] = {
    RESULT(VK_NOT_READY, GENERAL),
    RESULT(VK_TIMEOUT, GENERAL),
    RESULT(VK_INCOMPLETE, GENERAL),
    RESULT(VK_ERROR_OUT_OF_HOST_MEMORY, OUT_OF_MEMORY),
    RESULT(VK_ERROR_OUT_OF_DEVICE_MEMORY, OUT_OF_MEMORY),
    RESULT(VK_ERROR_INITIALIZATION_FAILED, GENERAL),
    RESULT(VK_ERROR_DEVICE_LOST, DEVICE_LOST),
    RESULT(VK_ERROR_MEMORY_MAP_FAILED, GENERAL),
    RESULT(VK_ERROR_LAYER_NOT_PRESENT, GENERAL),
    RESULT(VK_ERROR_EXTENSION_NOT_PRESENT, GENERAL),
    RESULT(VK_ERROR_FEATURE_NOT_PRESENT, GENERAL),
    RESULT(VK_ERROR_INCOMPATIBLE_DRIVER, GENERAL),
    RESULT(VK_ERROR_TOO_MANY_OBJECTS, GENERAL),
    RESULT(VK_ERROR_FORMAT_NOT_SUPPORTED, GENERAL),
    RESULT(VK_ERROR_FRAGMENTED_POOL, OUT_OF_MEMORY),
    RESULT(VK_ERROR_OUT_OF_POOL_MEMORY, OUT_OF_MEMORY),
    RESULT(VK_ERROR_INVALID_EXTERNAL_HANDLE, GENERAL),
    RESULT(VK_ERROR_FRAGMENTATION, GENERAL),
    RESULT(VK_ERROR_SURFACE_LOST_KHR, GENERAL),
    RESULT(VK_ERROR_NATIVE_WINDOW_IN_USE_KHR, GENERAL),
    RESULT(VK_ERROR_INVALID_SHADER_NV, SHADER),
    RESULT(VK_ERROR_UNKNOWN, GENERAL),  // the last: any other
};

static const struct result_info *find_result(VkResult result)
{
    const struct result_info *info = results;

    while (info->result != result && info->result != VK_ERROR_UNKNOWN)
        ++info;
    return info;
}

const char *vkb_call_name(const char *call_text, size_t *length)
{
    const char *end = call_text + strcspn(call_text, "("), *start = end;

    while (start > call_text && start[-1] != '.' && start[-1] != '>')
        --start;
    *length = (size_t)(end - start);
    return start;
}

bool vkb_check(struct vkb_error *error, VkResult result, const char *call_text)
{
    if (result == VK_SUCCESS)
        return true;

    size_t length;
    const char *name = vkb_call_name(call_text, &length);

    const struct result_info *info = find_result(result);

    vkb_fail(error, info->kind, "%.*s failed with %s", (int)length, name, info->name);
    if (error->kind == VKB_ERROR_OUT_OF_MEMORY)
        vkb_add_words(error, ": memory is short. %s", vkb_memory_hint);
    error->result = result;
    snprintf(error->call, sizeof error->call, "%.*s", (int)length, name);
    return false;
}

static bool fail_memory(struct vkb_error *error, size_t count, size_t size)
{
    const double bytes = (double)count * (double)size;

    return vkb_fail(error, VKB_ERROR_OUT_OF_MEMORY,
                    "memory is short: the host has no %.4g %s more. %s",
                    bytes < 1 << 20 ? bytes : bytes / (1 << 20), bytes < 1 << 20 ? "bytes" : "MiB",
                    vkb_memory_hint);
}

// Allocation in one place: test builds count it and can make it fail (faults.h).
#ifdef VKBLOOM_FAULTS
#define REFUSED()          vkb_fault("vkb_alloc")
#define COUNT_BLOCKS(more) vkb_fault_blocks(more)
#else
#define REFUSED()          false
#define COUNT_BLOCKS(more) ((void)(more))
#endif

void *vkb_alloc(struct vkb_error *error, size_t count, size_t size)
{
    // calloc(0) may return NULL, which is not a failure here.
    void *memory = REFUSED() ? NULL : calloc(count ? count : 1, size);

    if (!memory)
        fail_memory(error, count, size);
    COUNT_BLOCKS(memory != NULL);
    return memory;
}

bool vkb_grow(struct vkb_error *error, void *array, size_t *capacity, size_t needed, size_t size)
{
    if (needed <= *capacity)
        return true;

    size_t grown = *capacity ? *capacity : 8;
    void *before;
    // memcpy, since the caller's pointer is not a void pointer.
    memcpy(&before, array, sizeof before);
    while (grown < needed)
        grown *= 2;
    void *memory = grown > SIZE_MAX / size || REFUSED() ? NULL : realloc(before, grown * size);
    if (!memory)
        return fail_memory(error, grown, size);
    COUNT_BLOCKS(before == NULL);
    memcpy(array, &memory, sizeof memory);
    *capacity = grown;
    return true;
}

void *vkb_append(struct vkb_error *error, void *pointers, size_t *count, size_t *capacity,
                 size_t size)
{
    char *first;
    void *object;

    if (!vkb_grow(error, pointers, capacity, *count + 1, sizeof object))
        return NULL;
    object = vkb_alloc(error, 1, size);
    if (!object)
        return NULL;
    memcpy(&first, pointers, sizeof first);
    memcpy(first + *count * sizeof object, &object, sizeof object);
    ++*count;
    return object;
}

void vkb_free(void *memory)
{
    COUNT_BLOCKS(-(memory != NULL));
    free(memory);
}

void vkb_return_freed(void)
{
#ifdef __GLIBC__
    (void)malloc_trim(0);
#endif
}

bool vkb_has_room(size_t mib)
{
    bool done = !REFUSED();
#ifdef __linux__
    // Address space only: memory that nobody writes to is not counted by anything else.
    void *room =
        mmap(NULL, mib << 20, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    done = done && room != MAP_FAILED;
    if (room != MAP_FAILED)
        munmap(room, mib << 20);
#endif
    return done;
}

bool vkb_fail_room(const char *what, size_t mib, struct vkb_error *error)
{
    return vkb_fail(error, VKB_ERROR_OUT_OF_MEMORY,
                    "memory is short: %s needs %zu MiB of address space, and this process gets no "
                    "more. Raise its limit (ulimit -v)",
                    what, mib);
}

bool vkb_require_room(const char *what, size_t mib, struct vkb_error *error)
{
    return vkb_has_room(mib) || vkb_fail_room(what, mib, error);
}
