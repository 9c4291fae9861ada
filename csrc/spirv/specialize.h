// A shader with the values of its specialization constants: what they rule out is gone before a
// driver sees the module. Drivers fold constants late, after most of their work on the module.
#ifndef VKB_SPECIALIZE_H
#define VKB_SPECIALIZE_H

#include "graph/params.h"
#include "graph/shader.h"
#include "vulkan/error.h"

// Whether it has specialization constants. Shaders of others come without: their modules, which may
// be of later versions of SPIR-V than those of the package, stay as they are.
bool vkb_has_constants(const struct vkb_shader *shader);

// Makes `*code`, which the caller frees with vkb_free, and its `*size` in bytes. The module has no
// specialization constants and no debug information.
bool vkb_specialize(const struct vkb_shader *shader, const struct vkb_constants *constants,
                    uint32_t **code, size_t *size, struct vkb_error *error);

#endif
