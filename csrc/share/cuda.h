// The part of CUDA's driver API that arrays on the device need. libcuda is opened at run time.
// Calls must not overlap, except those that say so; the core makes them with the GIL or vkb_memory.
#ifndef VKB_CUDA_H
#define VKB_CUDA_H

#include "vulkan/error.h"

#include <stdint.h>

typedef unsigned long long vkb_cuda_address;

// The primary context of a GPU, with a stream.
struct vkb_cuda;

// Memory that CUDA has imported.
struct vkb_cuda_memory {
    void *handle;
    vkb_cuda_address address;
    void *event;  // recorded by vkb_cuda_begin_copy and vkb_cuda_mark
};

// Opens the context of the GPU with that UUID; `name` is the adapter's. Fails with a value error if
// CUDA does not have that one.
struct vkb_cuda *vkb_cuda_open(const uint8_t uuid[16], const char *name, struct vkb_error *error);
void vkb_cuda_close(struct vkb_cuda *cuda);

// Makes the context the current one of this thread until vkb_cuda_leave, for code of others.
bool vkb_cuda_enter(struct vkb_cuda *cuda, struct vkb_error *error);
void vkb_cuda_leave(struct vkb_cuda *cuda);

// Fails if the core's stream is captured into a graph, which stays as it is. All functions below
// that give work to streams do so, too.
bool vkb_cuda_require_no_capture(struct vkb_cuda *cuda, struct vkb_error *error);

// Imports an exported timeline semaphore. The descriptor belongs to CUDA or is closed.
void *vkb_cuda_import_semaphore(struct vkb_cuda *cuda, int descriptor, struct vkb_error *error);
// No stream may still wait for it or signal it.
void vkb_cuda_free_semaphore(struct vkb_cuda *cuda, void *semaphore);
// Signals it when the stream has done all work that it has got so far.
bool vkb_cuda_signal(struct vkb_cuda *cuda, void *semaphore, uint64_t value,
                     struct vkb_error *error);
// Makes a stream wait for it; NULL: the core's.
bool vkb_cuda_wait(struct vkb_cuda *cuda, void *semaphore, uint64_t value, void *stream,
                   struct vkb_error *error);
// Waits until the core's stream has done all work. Both may overlap with other calls.
bool vkb_cuda_finish(struct vkb_cuda *cuda, struct vkb_error *error);
// The same of all streams of the context. Fails, and makes captures of graphs invalid, if a stream
// is captured.
bool vkb_cuda_settle(struct vkb_cuda *cuda);
// The same when the device was lost, for which streams may wait forever: it returns within about a
// second. If it fails, calls that would wait for a stream fail from then on, and what vkb_cuda_free
// and vkb_cuda_close would free stays CUDA's until the process ends.
bool vkb_cuda_settle_lost(struct vkb_cuda *cuda);

int vkb_cuda_ordinal(const struct vkb_cuda *cuda);
// As other libraries get it.
void *vkb_cuda_stream(const struct vkb_cuda *cuda);

enum { VKB_CUDA_NAME_SIZE = 320 };
// "name (uuid:...)" of a device by its ordinal.
void vkb_cuda_name(const struct vkb_cuda *cuda, int ordinal, char name[VKB_CUDA_NAME_SIZE]);

// Imports exported memory. The descriptor belongs to CUDA or is closed.
bool vkb_cuda_import(struct vkb_cuda *cuda, int descriptor, uint64_t size,
                     struct vkb_cuda_memory *memory, struct vkb_error *error);
// Waits for work that uses it. May overlap with other calls.
void vkb_cuda_free(struct vkb_cuda *cuda, struct vkb_cuda_memory *memory);

// Copies on the core's stream between addresses of CUDA's memory and the host's, and waits. May
// overlap with other calls.
bool vkb_cuda_copy(struct vkb_cuda *cuda, vkb_cuda_address to, vkb_cuda_address from, size_t size,
                   struct vkb_error *error);
// The same to imported memory on a stream, NULL: the core's, without the wait, which follows. Both
// may overlap with other calls.
bool vkb_cuda_begin_copy(struct vkb_cuda *cuda, struct vkb_cuda_memory *to, vkb_cuda_address from,
                         size_t size, void *stream, struct vkb_error *error);
bool vkb_cuda_end_copy(struct vkb_cuda *cuda, const struct vkb_cuda_memory *to,
                       struct vkb_error *error);
// Makes all work that the context gets from now on wait for the copy, so that its source can be
// freed or overwritten: nothing tells which stream would do that. False while a graph is captured,
// which becomes invalid; then the host has to wait.
bool vkb_cuda_order_copy(struct vkb_cuda *cuda, const struct vkb_cuda_memory *to);

// Remembers the work that the context has got so far, which may use the memory; and whether it is
// over. It is not possible while a stream is captured into a graph, which becomes invalid.
bool vkb_cuda_mark(struct vkb_cuda *cuda, struct vkb_cuda_memory *memory);
bool vkb_cuda_passed(struct vkb_cuda *cuda, struct vkb_cuda_memory *memory);

#endif
