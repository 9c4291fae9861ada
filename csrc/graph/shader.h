// A shader as an object: those of the package, which spirv.h declares, and those that are made
// while the program runs. Rows refer to it. Keys of pipelines and recipes of images hold its hash.
#ifndef VKB_SHADER_H
#define VKB_SHADER_H

#include <stddef.h>
#include <stdint.h>

// The first 16 bytes of the SHA-256 of the SPIR-V.
struct vkb_hash {
    unsigned char bytes[16];
};

struct vkb_shader {
    const char *name;
    const uint32_t *code;  // SPIR-V with the entry point main
    size_t size;           // in bytes
    struct vkb_hash hash;
    // The same pass as a compute shader; with a target of three channels; with a first image of
    // three; for images with layers. NULL: there is none.
    const struct vkb_shader *dispatch, *packed, *rgb, *layers;
    // Of a compute shader that is made at run time: threads of a workgroup, bytes of shared memory.
    uint32_t threads[2], shared;
};

// That of NULL is zero.
static inline struct vkb_hash vkb_shader_hash(const struct vkb_shader *shader)
{
    return shader ? shader->hash : (struct vkb_hash){{0}};
}

#endif
