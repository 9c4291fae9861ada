// Shared by the files of this folder. The only header of the core that includes Python.h.
#ifndef VKB_MODULE_H
#define VKB_MODULE_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include "graph/bands.h"
#include "methods/source.h"
#include "python/guard.h"
#include "run/frame.h"
#include "variants/variants.h"
#include "vulkan/process.h"

#include <stdatomic.h>

struct vkb_module_state {
    PyObject *renderer_type, *source_type, *plan_type, *submission_type, *pages_type, *shader_type,
        *resource_type, *exported_type;
    PyObject *errors[VKB_ERROR_VALUE + 1];  // exception classes by enum vkb_error_kind
    PyObject *attributes;                   // tuple of the names that vkb_read_settings reads
};

struct vkb_module_state *vkb_module_state(PyObject *module);

// Creates an object of a heap type with zeroed members. NULL with an exception set.
void *vkb_new_object(PyObject *type);
// Frees an object whose members have been released, and releases its type: the end of tp_dealloc.
void vkb_free_object(PyObject *object);
// tp_dealloc of the types whose tp_clear releases all members.
void vkb_dealloc(PyObject *object);

// Python cannot create objects of types with these flags.
#define VKB_TYPE_FLAGS \
    (Py_TPFLAGS_DEFAULT | Py_TPFLAGS_IMMUTABLETYPE | Py_TPFLAGS_DISALLOW_INSTANTIATION)

// Raises the exception class of the error; returns NULL.
PyObject *vkb_raise(const struct vkb_module_state *state, const struct vkb_error *error);

// (name, type, driver, driver_info, api_version, driver UUID as bytes, bundled, UUID, PCI address)
PyObject *vkb_adapter_tuple(const struct vkb_adapter_info *adapter);

extern PyType_Spec vkb_renderer_spec, vkb_source_spec, vkb_plan_spec, vkb_submission_spec,
    vkb_pages_spec, vkb_shader_spec, vkb_resource_spec, vkb_exported_spec;

// The data of a submission until the device has finished it. If nobody waits for it any more, it is
// abandoned: the renderer owns it.
struct vkb_pending {
    struct vkb_submission *submission;  // NULL: not submitted
    PyObject *plans;                // a tuple: their graphs are read until the device has finished
    PyObject *source;               // read by the device until then
    struct vkb_resident *resident;  // of the source, in use; NULL: none
    struct vkb_request *requests;
    struct vkb_output *outputs;  // of all requests, one after the other
    Py_buffer *views;            // of the outputs
    struct vkb_timing *timings;
    struct vkb_specials *layer_specials;  // of a batch
    uint32_t count;                       // of the requests
    size_t view_count;
    struct vkb_pending *next;
};

struct vkb_renderer {
    PyObject_HEAD
    PyThread_type_lock lock;           // held, without the GIL, around all device work
    VKB_ATOMIC(unsigned long) holder;  // the thread with the lock, 0: none
    PyThreadState *thread;             // of that thread, while it has released the GIL
    long process;                      // that opened it; a forked process must not use the device
    atomic_bool open;                  // written with the lock, read without it
    const struct vkb_messages
        *before;      // receives the messages when the thread with the lock leaves
    uint64_t serial;  // identifies the renderer of a plan; never 0
    // Written with the lock and vkb_memory. Used with vkb_memory, if the renderer is open then.
    VKB_ATOMIC(struct vkb_pages *) pages;          // of large arrays; NULL: closed
    VKB_ATOMIC(struct vkb_residents *) residents;  // of handles; NULL: closed
    // Of arrays that CUDA shares; NULL: none so far, or closed.
    VKB_ATOMIC(struct vkb_exports *) exports;
    VKB_GUARD(guard)  // of the next three
    struct vkb_pending *abandoned;
    size_t pipeline_count;  // created so far
    struct vkb_cached cached;
    enum vkb_variants variants;
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

// With the GIL; the device must have finished the submission.
void vkb_pending_release(struct vkb_pending *pending);
int vkb_pending_traverse(const struct vkb_pending *pending, visitproc visit, void *arg);

// Creates the names that vkb_read_settings reads; false with an exception set.
bool vkb_make_attributes(struct vkb_module_state *state);

// Reads the attributes of a settings object; missing ones have their defaults. False with an
// exception set.
bool vkb_read_settings(const struct vkb_module_state *state, PyObject *object,
                       struct vkb_settings *settings);

struct vkb_held_kernel;

// Reads the stages of glare of a settings object; without the attribute there are none.
bool vkb_read_glare(PyObject *object, struct vkb_settings *settings);

// Asks the stage of dirt, if there is one, for its picture.
bool vkb_read_dirt(PyObject *object, struct vkb_held_kernel *held, struct vkb_settings *settings);

// Stores a number in the member of the row; false with an exception set.
bool vkb_read_number(PyObject *value, const struct vkb_value_row *row, void *values);

// Returns the index of a str among `count` names; otherwise -1 with the ValueError "what: unknown
// noun 'value'" set.
int vkb_read_name(PyObject *value, const char *const *names, int count, const char *what,
                  const char *noun);

// Sets the ValueError of a number that is out of its range; returns false.
bool vkb_out_of_range(const char *name, PyObject *value, double low, double high);

// Whether the object is a tuple, which PyArg_ParseTuple requires; otherwise sets a TypeError.
bool vkb_require_tuple(PyObject *object, const char *what);

// Converters for PyArg_ParseTuple ("O&"): its own codes for unsigned integers accept any number
// modulo 2^32. 0 with an exception set.
int vkb_read_uint32(PyObject *object, void *number);
int vkb_read_serial(PyObject *object, void *number);  // 64 bits, not 0

// (position, rotation, fov, near, far), the first two of three numbers each.
bool vkb_read_camera(PyObject *tuple, struct vkb_camera *camera);

// The buffer protocol's code of the element type; 0 if it is not a single number in native byte
// order.
char vkb_element_code(const Py_buffer *view);
bool vkb_has_element(const Py_buffer *view, const char *codes);

// The format of pixels whose channels have the element type B, e or f.
enum vkb_format vkb_pixel_format(char code);

// The arrays of a scene, held until vkb_release_scene. Releasing a zeroed or half-read one is safe.
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

// The pixels of an image, held until vkb_release_image. Releasing a zeroed or half-read one is
// safe.
struct vkb_held_image {
    struct vkb_input input;
    Py_buffer view;
    bool held;
};

// An array (H, W, 3) or (H, W, 4) of uint8, float16 or float32, any strides; or (Exported, offset,
// (H, W, C), strides, code of the element). `name` is the argument's.
bool vkb_read_image(PyObject *array, const char *name, struct vkb_held_image *image);
// An array (H, W) of float32, any strides.
bool vkb_read_mask(PyObject *array, struct vkb_held_image *image);
void vkb_release_image(struct vkb_held_image *image);

// Whether the object is memory that CUDA shares; that memory, and to what it belongs.
bool vkb_is_exported(PyObject *object);
struct vkb_export *vkb_export_of(PyObject *object, const struct vkb_exports **exports);

// The kernel of a convolution, held until vkb_release_kernel, which may be called on a zeroed one.
struct vkb_held_kernel {
    Py_buffer view;
    bool held;
};

// Asks a convolution's settings for the kernel of these sizes, or only for about its size.
bool vkb_read_kernel_size(PyObject *object, struct vkb_size frame, struct vkb_size buffers,
                          struct vkb_kernel_data *kernel);
bool vkb_read_kernel(PyObject *object, struct vkb_size frame, struct vkb_size buffers,
                     struct vkb_held_kernel *held, struct vkb_kernel_data *kernel);
void vkb_release_kernel(struct vkb_held_kernel *held);

// The passes of a method that was given at run time, held until vkb_release_passes, which may be
// called on a zeroed one. The tuple keeps their shaders, to which the rows of a graph refer.
struct vkb_held_passes {
    PyObject *tuple;
    struct vkb_own_pass *rows;
};

// Asks the settings of such a method for its passes.
bool vkb_hold_passes(const struct vkb_module_state *state, PyObject *object, uint32_t max_side,
                     const struct vkb_source *source, struct vkb_held_passes *held,
                     struct vkb_settings *settings);
void vkb_release_passes(struct vkb_held_passes *held);

// Of a Resource object, which keeps it.
const struct vkb_resource *vkb_resource_of(PyObject *object);

// In hex.
PyObject *vkb_hash_text(const struct vkb_hash *hash);

// An image is the caller's array, or one that stays on the device of a renderer.
struct vkb_source_object {
    PyObject_HEAD
    struct vkb_source source;
    struct vkb_held_scene scene;
    struct vkb_held_image images[VKB_INPUT_COUNT];  // by kind
    VKB_ATOMIC(struct vkb_resident *) resident;     // NULL: none, or taken by another source
    struct vkb_residents *residents;
    long process;  // whose device the resident image is on
};

// Whether the renderer can use the source; else with a ValueError set.
bool vkb_check_source(const struct vkb_renderer *renderer, const struct vkb_source_object *source);

// Fails if this is the address of no open screen of the renderer. With the renderer's lock.
bool vkb_require_screen(const struct vkb_renderer *renderer, const struct vkb_screen *screen,
                        struct vkb_error *error);

struct vkb_plan_object {
    PyObject_HEAD
    struct vkb_source source;
    struct vkb_plan plan;
    uint64_t renderer;  // serial of its renderer; 0: none, for inspection only
    PyObject *outputs;  // ((name, shape, dtype), ...)
    struct vkb_held_kernel kernel, dirt;
    struct vkb_held_passes passes;
};

// Size in bytes of an output in the caller's array.
size_t vkb_output_size(const struct vkb_plan *plan, uint32_t output);
// Of a batch: bytes from the output of an image to that of the next.
size_t vkb_layer_stride(const struct vkb_plan *plan, uint32_t output);

// Sets an item of a new tuple, whose reference the tuple gets; false if it is NULL.
bool vkb_set_item(PyObject *tuple, Py_ssize_t index, PyObject *item);

// Appends an item to a list and releases it; false if it is NULL.
bool vkb_append_item(PyObject *list, PyObject *item);

// A tuple of the names of images.
PyObject *vkb_image_names(const struct vkb_graph *graph, const uint32_t *images, uint32_t count);

// A tuple of up to GATHERED_LEVELS names of images.
bool vkb_read_names(PyObject *tuple, vkb_image_name *names, uint32_t *count);

// The part of a graph that makes the names, from (rows of the image, names of the levels that the
// source brings, whether it is a band of the image).
bool vkb_read_part(PyObject *tuple, const struct vkb_source_object *source, PyObject *names,
                   struct vkb_part *part);
bool vkb_build_part(const struct vkb_source *source, const struct vkb_settings *settings,
                    const struct vkb_part *part, struct vkb_graph *graph, struct vkb_error *error);

struct vkb_cotangents;

// What a plan is of, if not of all passes.
struct vkb_portion {
    const struct vkb_part *part;
    const struct vkb_cotangents *cotangents;
    uint32_t first;    // of the images of derivatives
    bool is_possible;  // whether all passes have adjoints
};

// Makes a plan; `renderer` is the serial of its renderer, or 0, and `portion` may be NULL. NULL
// with an exception set.
PyObject *vkb_new_plan(const struct vkb_module_state *state, const struct vkb_device *device,
                       enum vkb_variants variants, uint64_t renderer, PyObject *source,
                       PyObject *settings_object, struct vkb_settings *settings,
                       struct vkb_portion *portion, PyObject *names);

// Functions of the module.
PyObject *vkb_image_source(PyObject *module, PyObject *arguments);
PyObject *vkb_scene_source(PyObject *module, PyObject *arguments);
PyObject *vkb_make_shader(PyObject *module, PyObject *arguments);
PyObject *vkb_make_resource(PyObject *module, PyObject *arguments);
PyObject *vkb_read_dlpack(PyObject *module, PyObject *capsule);
PyObject *vkb_any_plan(PyObject *module, PyObject *arguments);
PyObject *vkb_dry_run_names(PyObject *module, PyObject *steps);

// Methods of the Renderer.
PyObject *vkb_renderer_adjoint(PyObject *renderer, PyObject *arguments);
PyObject *vkb_renderer_plan(PyObject *renderer, PyObject *arguments);
PyObject *vkb_renderer_bands(PyObject *renderer, PyObject *arguments);
PyObject *vkb_renderer_run(PyObject *renderer, PyObject *arguments);
PyObject *vkb_renderer_show(PyObject *renderer, PyObject *arguments);
PyObject *vkb_open_screen(PyObject *renderer, PyObject *arguments);
PyObject *vkb_close_screen(PyObject *renderer, PyObject *screen);
PyObject *vkb_new_pages(PyObject *renderer, PyObject *size);
PyObject *vkb_renderer_upload(PyObject *renderer, PyObject *arguments);
PyObject *vkb_renderer_export(PyObject *renderer, PyObject *size);
PyObject *vkb_renderer_cuda(PyObject *renderer, PyObject *unused);
PyObject *vkb_renderer_cuda_name(PyObject *renderer, PyObject *ordinal);
PyObject *vkb_renderer_snapshot(PyObject *renderer, PyObject *arguments);
PyObject *vkb_renderer_fill(PyObject *renderer, PyObject *arguments);

#ifdef VKBLOOM_FAULTS
PyObject *vkb_fault_arm(PyObject *module, PyObject *arguments);
PyObject *vkb_fault_state(PyObject *module, PyObject *unused);
PyObject *vkb_fault_forget(PyObject *module, PyObject *unused);
#endif

#endif
