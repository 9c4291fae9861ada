// What the files that speak Python share: module.c, renderer.c, source.c, plan.c, requests.c,
// arrays.c, arguments.c, scene_arguments.c, and faults.c in test builds. The only header of the
// core that includes Python.h.
#ifndef VKB_MODULE_H
#define VKB_MODULE_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include "methods/source.h"
#include "run/frame.h"
#include "variants/variants.h"
#include "vulkan/process.h"

#include <stdatomic.h>

struct vkb_module_state {
    PyObject *renderer_type, *source_type, *plan_type, *submission_type, *pages_type;
    PyObject *errors[VKB_ERROR_VALUE + 1];  // exception classes by enum vkb_error_kind
    PyObject *attributes;                   // tuple of the names that vkb_read_settings asks for
};

struct vkb_module_state *vkb_module_state(PyObject *module);

// Raises the exception that fits; returns NULL.
PyObject *vkb_raise(const struct vkb_module_state *state, const struct vkb_error *error);

// (name, type, driver, driver_info, api_version, driver UUID as bytes)
PyObject *vkb_adapter_tuple(const struct vkb_adapter_info *adapter);

extern PyType_Spec vkb_renderer_spec, vkb_source_spec, vkb_plan_spec, vkb_submission_spec,
    vkb_pages_spec;

// What a submission needs until the device is done with it. Once it is abandoned, because nobody
// waits for it any more, the renderer has it.
struct vkb_pending {
    struct vkb_submission *submission;  // NULL: not submitted
    PyObject *plans;                    // a tuple: their graphs are read until then
    struct vkb_request *requests;
    struct vkb_output *outputs;  // of all requests, one after the other
    Py_buffer *views;            // of the outputs
    struct vkb_timing *timings;
    uint32_t count;  // of the requests
    size_t view_count;
    struct vkb_specials specials;
    struct vkb_pending *next;
};

struct vkb_renderer {
    PyObject_HEAD
    PyThread_type_lock lock;  // held, without the GIL, around all that touches the device
    unsigned long holder;     // the thread that holds it, 0: none; read and written with the GIL
    PyThreadState *thread;    // that thread's, while it has given the GIL back
    struct vkb_pending *abandoned;  // touched with the GIL
    long process;      // that opened it: the device is no other's, not even a forked one's
    atomic_bool open;  // changed with the lock, looked at without
    const struct vkb_messages *before;  // whose the messages are when the holder leaves
    uint64_t serial;                    // by which plans know it; never 0
    struct vkb_pages *pages;            // of large arrays; NULL: closed
    size_t pipeline_count;              // made so far; read and written with the GIL
    struct vkb_cached cached;           // read and written with the GIL
    enum vkb_variants variants;
    struct vkb_device device;
    struct vkb_frame frame;
};

// Fails where the renderer is closed or another process's, or its device lost.
bool vkb_require_open(const struct vkb_renderer *renderer, struct vkb_error *error);

// Takes the renderer's lock and gives the GIL back, and the other way round. Waiting for the lock
// can be interrupted by a signal; then, and where a signal's handler asks for what the thread that
// it interrupted has, the first one fails, with the GIL. The second one releases what is
// abandoned and over.
bool vkb_renderer_enter(struct vkb_renderer *renderer, struct vkb_error *error);
void vkb_renderer_leave(struct vkb_renderer *renderer);

// Whether what was `done` is so without a validation message either: such a message says more than
// the failure that it led to. After an interruption, whose exception is set, the messages wait for
// the next call. With the lock.
bool vkb_renderer_check_messages(struct vkb_renderer *renderer, bool done, struct vkb_error *error);

// Whether this is the process that opened the renderer.
bool vkb_renderer_is_ours(const struct vkb_renderer *renderer);
// Takes over what nobody waits for any more. With the GIL.
void vkb_renderer_abandon(struct vkb_renderer *renderer, struct vkb_pending *pending);

// With the GIL; the device must be done with it.
void vkb_pending_release(struct vkb_pending *pending);
int vkb_pending_traverse(const struct vkb_pending *pending, visitproc visit, void *arg);

// Makes what vkb_read_settings keeps in the state; false with an exception set.
bool vkb_make_attributes(struct vkb_module_state *state);

// A settings object's attributes; one that it lacks keeps its default. False with an
// exception set.
bool vkb_read_settings(const struct vkb_module_state *state, PyObject *object,
                       struct vkb_settings *settings);

// Whether it is a tuple, as PyArg_ParseTuple must have it; else with a TypeError set.
bool vkb_require_tuple(PyObject *object, const char *what);

// Converters of PyArg_ParseTuple ("O&"), whose own codes for unsigned integers take any
// number modulo 2^32. 0 with an exception set.
int vkb_read_uint32(PyObject *object, void *number);
int vkb_read_serial(PyObject *object, void *number);  // 64 bits, not 0

// (position, rotation, fov, near, far), the first two of three numbers each.
bool vkb_read_camera(PyObject *tuple, struct vkb_camera *camera);

// The buffer protocol's code of the element type; 0 for anything but one number in this machine's
// byte order.
char vkb_element_code(const Py_buffer *view);
bool vkb_has_element(const Py_buffer *view, const char *codes);

// The format of pixels whose channels have that element type: B, e or f.
enum vkb_format vkb_pixel_format(char code);

// A scene's arrays, held until vkb_release_scene, which may be called on a zeroed or half-read one.
struct vkb_held_scene {
    struct vkb_scene_data data;
    Py_buffer *views;
    size_t view_count;
};

// (serial, body, glow or None, sky levels, textures); a mesh is (vertices, indices, emission or
// None, texcoords or None, surfaces), a surface (index count, base texture, emission texture), a
// texture (levels, address mode along u, v, magnification, minification, mipmap filter).
bool vkb_read_scene(PyObject *tuple, struct vkb_held_scene *scene);
void vkb_release_scene(struct vkb_held_scene *scene);

// An image's pixels, held until vkb_release_image, which may be called on a zeroed or half-read
// one.
struct vkb_held_image {
    struct vkb_input input;
    Py_buffer view;
    bool held;
};

// An array (H, W, 3) or (H, W, 4) of uint8, float16 or float32, any strides; `name` is the
// argument's.
bool vkb_read_image(PyObject *array, const char *name, struct vkb_held_image *image);
// An array (H, W) of float32, any strides.
bool vkb_read_mask(PyObject *array, struct vkb_held_image *image);
void vkb_release_image(struct vkb_held_image *image);

// The kernel of a convolution, held until vkb_release_kernel, which may be called on a zeroed one.
struct vkb_held_kernel {
    Py_buffer view;
    bool held;
};

// Asks a convolution's settings for the kernel of these sizes.
bool vkb_read_kernel(PyObject *object, struct vkb_size frame, struct vkb_size buffers,
                     struct vkb_held_kernel *held, struct vkb_kernel_data *kernel);
void vkb_release_kernel(struct vkb_held_kernel *held);

struct vkb_source_object {
    PyObject_HEAD
    struct vkb_source source;
    struct vkb_held_scene scene;
    struct vkb_held_image images[VKB_INPUT_COUNT];  // by kind
};

struct vkb_plan_object {
    PyObject_HEAD
    struct vkb_source source;
    struct vkb_plan plan;
    uint64_t renderer;  // whose plan it is; 0: nobody's, to be looked at
    PyObject *outputs;  // ((name, shape, dtype), ...)
    struct vkb_held_kernel kernel;
};

// Bytes of an output in the caller's array.
size_t vkb_output_size(const struct vkb_plan *plan, uint32_t output);

// Functions of the module.
PyObject *vkb_image_source(PyObject *module, PyObject *arguments);
PyObject *vkb_scene_source(PyObject *module, PyObject *arguments);
PyObject *vkb_any_plan(PyObject *module, PyObject *arguments);
PyObject *vkb_dry_run_names(PyObject *module, PyObject *steps);

// Methods of the Renderer.
PyObject *vkb_renderer_plan(PyObject *renderer, PyObject *arguments);
PyObject *vkb_renderer_run(PyObject *renderer, PyObject *arguments);
PyObject *vkb_new_pages(PyObject *renderer, PyObject *size);

#ifdef VKBLOOM_FAULTS
PyObject *vkb_fault_arm(PyObject *module, PyObject *arguments);
PyObject *vkb_fault_state(PyObject *module, PyObject *unused);
PyObject *vkb_fault_forget(PyObject *module, PyObject *unused);
#endif

#endif
