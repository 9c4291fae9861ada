// The types and functions of the module.
#ifndef VKB_PYTHON_MODULE_H
#define VKB_PYTHON_MODULE_H

#include "python/objects.h"

extern PyType_Spec vkb_renderer_spec, vkb_source_spec, vkb_contents_spec, vkb_plan_spec,
    vkb_submission_spec, vkb_pages_spec, vkb_exported_spec;

// Functions of the module.
PyObject *vkb_image_source(PyObject *module, PyObject *arguments);
PyObject *vkb_scene_contents(PyObject *module, PyObject *arguments);
PyObject *vkb_scene_source(PyObject *module, PyObject *arguments);
PyObject *vkb_read_dlpack(PyObject *module, PyObject *capsule);
PyObject *vkb_any_plan(PyObject *module, PyObject *arguments);
PyObject *vkb_dry_run_steps(PyObject *module, PyObject *steps);
PyObject *vkb_resource_owner(PyObject *module, PyObject *unused);

// Methods of the Renderer.
PyObject *vkb_renderer_plan(PyObject *renderer, PyObject *arguments);
PyObject *vkb_renderer_run(PyObject *renderer, PyObject *arguments);
PyObject *vkb_open_screen(PyObject *renderer, PyObject *arguments);
PyObject *vkb_close_screen(PyObject *renderer, PyObject *screen);
PyObject *vkb_new_pages(PyObject *renderer, PyObject *size);
PyObject *vkb_renderer_upload(PyObject *renderer, PyObject *arguments);
PyObject *vkb_renderer_export(PyObject *renderer, PyObject *size);
PyObject *vkb_renderer_cuda(PyObject *renderer, PyObject *unused);
PyObject *vkb_renderer_in_context(PyObject *renderer, PyObject *function);
PyObject *vkb_renderer_cuda_name(PyObject *renderer, PyObject *ordinal);
PyObject *vkb_renderer_snapshot(PyObject *renderer, PyObject *arguments);

#ifdef VKBLOOM_FAULTS
PyObject *vkb_fault_arm(PyObject *module, PyObject *arguments);
PyObject *vkb_fault_state(PyObject *module, PyObject *unused);
PyObject *vkb_fault_forget(PyObject *module, PyObject *unused);
PyObject *vkb_fault_fold(PyObject *module, PyObject *by_driver);
#endif

#endif
