// Settings, images, scenes and cameras as C structs.
#ifndef VKB_PYTHON_ARGUMENTS_H
#define VKB_PYTHON_ARGUMENTS_H

#include "python/objects.h"

#include "methods/source.h"
#include "scene/scene.h"
#include "share/exported_memory.h"
#include "transfer/upload.h"

// The types of numbers in arrays, as the struct module writes them.
enum { VKB_UINT8 = 'B', VKB_FLOAT16 = 'e', VKB_FLOAT32 = 'f', VKB_UINT32 = 'I' };

// Whether the array's numbers have that type, in the byte order of the host.
bool vkb_is_number(const Py_buffer *view, char type);
// Holds a contiguous array of such numbers, and of so many bytes. False with an exception set,
// which begins with the name; the view may be held then, too. `flags`: further ones of PyBUF_*.
bool vkb_hold_array(PyObject *object, const char *name, char type, int flags, Py_buffer *view);
bool vkb_hold_bytes(PyObject *object, const char *name, char type, int flags, size_t size,
                    Py_buffer *view);
// A side of an image. Those beyond every adapter's limit are refused with the plan.
uint32_t vkb_side(Py_ssize_t length);

// The members of the blocks of a settings object and of a stage of glare, by name: offset, code of
// the elements and their number. New references; NULL with an exception set.
PyObject *vkb_settings_block_table(void);
PyObject *vkb_stage_block_table(void);

// Asks a settings object for its block; false with an exception set.
bool vkb_read_settings(PyObject *object, struct vkb_settings *settings);

// Asks a convolution's settings for the kernel of these sizes, which `view` holds; for one that is
// kept from an earlier call; or only for about its size.
bool vkb_find_kernel(PyObject *object, struct vkb_size frame, struct vkb_size buffers,
                     Py_buffer *view, struct vkb_kernel_data *kernel, bool *found);
bool vkb_read_kernel_size(PyObject *object, struct vkb_size frame, struct vkb_size buffers,
                          struct vkb_kernel_data *kernel);
bool vkb_read_kernel(PyObject *object, struct vkb_size frame, struct vkb_size buffers,
                     Py_buffer *view, struct vkb_kernel_data *kernel);

// Asks the same settings for the weights of a field, whose kernels are those that were read.
bool vkb_read_field(PyObject *object, struct vkb_size frame, struct vkb_size buffers,
                    Py_buffer *weights, Py_buffer *places, struct vkb_settings *settings);

// Asks settings with an exposure for the mask of its meter, which is a kernel or None.
bool vkb_read_exposure_mask(PyObject *object, Py_buffer *view, struct vkb_settings *settings);
// Asks the stage of dirt, if there is one, for its picture.
bool vkb_read_dirt(PyObject *object, Py_buffer *view, struct vkb_settings *settings);

// The meshes and pictures of a scene: of the body and of the glow vertices, indices and, with
// surfaces, texture coordinates and surfaces; then the levels of the sky and of the textures.
struct vkb_contents_object {
    PyObject_HEAD
    struct vkb_scene_data data;
    bool has_emission;
    Py_buffer *views;
    size_t view_count;
};

// Reads the block of a frame of that scene; false with an exception set.
bool vkb_read_frame(PyObject *block, const struct vkb_contents_object *contents,
                    struct vkb_source *source);

// The pixels of an image. The view holds the array or, of an image in exported memory, the
// Exported; it has no object where there is no image.
struct vkb_held_image {
    struct vkb_input input;
    Py_buffer view;
};

// An array (H, W, 3) or (H, W, 4) of uint8, float16 or float32, any strides; or (Exported, offset,
// (H, W, C), strides, bytes of an element). What has one channel (`vkb_is_grey`) is an array (H, W)
// of float32, or a tuple as above. False with an exception set, which begins with the name; the
// image may be held then, too.
bool vkb_read_image(PyObject *array, const char *name, struct vkb_held_image *image);
bool vkb_read_grey(PyObject *array, const char *name, struct vkb_held_image *image);

// Whether the object is memory that CUDA shares; that memory, and to what it belongs.
bool vkb_is_exported(PyObject *object);
struct vkb_export *vkb_export_of(PyObject *object, const struct vkb_exports **exports);
// As vkb_frame_source has it; `context` is the renderer.
bool vkb_fill_exported(void *context, struct vkb_export *exported, struct vkb_error *error);

// The passes of a method that was given at run time, held until vkb_release_passes, which may be
// called on a zeroed one. The tuple keeps their shaders and resources, to which the rows of a graph
// refer.
struct vkb_held_passes {
    PyObject *tuple;
    struct vkb_custom_pass *rows;
    struct vkb_pass_content *content;
};

// Asks the settings of such a method for its passes.
bool vkb_hold_passes(const struct vkb_module_state *state, PyObject *object, uint32_t max_side,
                     const struct vkb_source *source, struct vkb_held_passes *held,
                     struct vkb_settings *settings);
void vkb_release_passes(struct vkb_held_passes *held);

#endif
