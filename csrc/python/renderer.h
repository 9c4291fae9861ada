// The Renderer type, its lock, and submissions that are not finished.
#ifndef VKB_PYTHON_RENDERER_H
#define VKB_PYTHON_RENDERER_H

#include "python/objects.h"

#include "execute/frame.h"
#include "passes/transposes.h"
#include "python/guard.h"
#include "variants/variants.h"
#include "vulkan/process.h"

#include <stdatomic.h>

// The data of a submission until the device has finished it. If nobody waits for it any more, it is
// abandoned: the renderer owns it.
struct vkb_pending {
    struct vkb_submission *submission;  // NULL: not submitted
    PyObject *plans;  // a tuple: their graphs are read until the device has finished
    // Used by the device until then: the source, what calls before have made, and what this one
    // makes for the next.
    PyObject *sources[1 + 2 * VKB_MAX_HISTORIES];
    uint32_t source_count;
    struct vkb_request *requests;
    struct vkb_output *outputs;  // of all requests, one after the other
    Py_buffer *views;            // of the outputs
    struct vkb_timing *timings;
    struct vkb_non_finite *layer_non_finite;  // of a batch
    uint32_t count;                           // of the requests
    size_t view_count;
    struct vkb_pending *next;
};

struct vkb_renderer {
    PyObject_HEAD
    PyThread_type_lock lock;           // held, without the GIL, around all device work
    VKB_ATOMIC(unsigned long) holder;  // the thread with the lock, 0: none
    PyThreadState *thread;             // of that thread, while it has released the GIL
    uint64_t number;                   // that no other renderer of this process has
    long process;                      // that opened it; a forked process must not use the device
    atomic_bool open;                  // written with the lock, read without it
    const struct vkb_messages
        *before;  // receives the messages when the thread with the lock leaves
    // Written with the lock and vkb_memory. Used with vkb_memory, if the renderer is open then.
    VKB_ATOMIC(struct vkb_pages *) pages;          // of large arrays; NULL: closed
    VKB_ATOMIC(struct vkb_residents *) residents;  // of handles; NULL: closed
    // Of arrays that CUDA shares; NULL: none so far, or closed.
    VKB_ATOMIC(struct vkb_exports *) exports;
    VKB_GUARD(guard)  // of the next four
    struct vkb_pending *abandoned;
    size_t pipeline_count;  // created so far
    struct vkb_cached cached;
    struct vkb_transposes transposes;  // of plans of derivatives
    struct vkb_variants variants;
    struct vkb_device device;
    struct vkb_frame frame;
};

// Fails if the renderer is closed, belongs to another process, or has lost its device.
bool vkb_require_open(const struct vkb_renderer *renderer, struct vkb_error *error);

// vkb_renderer_enter takes the renderer's lock and releases the GIL. It fails, with the GIL, if a
// signal interrupts the wait for the lock, or if a signal handler runs in the thread that has the
// lock. vkb_renderer_leave does the reverse, and releases abandoned submissions that have finished.
bool vkb_renderer_enter(struct vkb_renderer *renderer, struct vkb_error *error);
void vkb_renderer_leave(struct vkb_renderer *renderer);
// As vkb_renderer_leave; the renderer gets these exports, unless they are NULL.
void vkb_renderer_leave_with(struct vkb_renderer *renderer, struct vkb_exports *exports);

// Returns `done`, or false if there are validation messages; then the error has these, since they
// explain a failure better. After an interruption, with its exception set, the messages are kept
// for the next call. Called with the lock.
bool vkb_renderer_check_messages(struct vkb_renderer *renderer, bool done, struct vkb_error *error);

// Releases abandoned submissions that have finished. With the GIL.
void vkb_renderer_release_finished(struct vkb_renderer *renderer);
// Called between the slices of a wait, with the renderer: whether a signal handler has raised.
bool vkb_renderer_interrupted(void *renderer);

// Whether this is the process that opened the renderer.
bool vkb_renderer_is_ours(const struct vkb_renderer *renderer);
// Makes the renderer the owner of a submission that nobody waits for. With the GIL.
void vkb_renderer_abandon(struct vkb_renderer *renderer, struct vkb_pending *pending);

// Makes it use a source (a struct vkb_source_object).
void vkb_pending_use(struct vkb_pending *pending, PyObject *source);
// With the GIL; the device must have finished the submission. A set exception is kept.
void vkb_pending_release(struct vkb_pending *pending);
int vkb_pending_traverse(const struct vkb_pending *pending, visitproc visit, void *arg);

// Ends a use of exports. With the GIL, which it releases, and without vkb_memory.
void vkb_release_exports(struct vkb_exports *exports);

// Fails if this is the address of no open screen of the renderer. With the renderer's lock.
bool vkb_require_screen(const struct vkb_renderer *renderer, const struct vkb_screen *screen,
                        struct vkb_error *error);

#endif
