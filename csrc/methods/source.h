// A source without its data: all that a graph depends on. A new kind of source needs a struct here,
// a case in each function of source.c, and its data in struct vkb_frame_source.
#ifndef VKB_SOURCE_H
#define VKB_SOURCE_H

#include "methods/methods.h"

// A zeroed source has the kind NONE.
enum vkb_source_kind { VKB_SOURCE_NONE, VKB_SOURCE_IMAGE, VKB_SOURCE_SCENE };

struct vkb_source {
    enum vkb_source_kind kind;
    char shading[VKB_NAME_SIZE];  // of a scene
    union {
        struct vkb_image_source image;
        struct vkb_scene_source scene;
    };
};

// Builds the graph of the source with the passes of the method, before variants are chosen.
bool vkb_source_build(const struct vkb_source *source, const struct vkb_settings *settings,
                      uint32_t max_side, struct vkb_graph *graph, struct vkb_error *error);

// The sizes that the source's graph begins with: of the frame, and of its bloom buffers. A VALUE
// error where they are out of range.
bool vkb_source_sizes(const struct vkb_source *source, const struct vkb_settings *settings,
                      uint32_t max_side, struct vkb_size *frame, struct vkb_size *buffers,
                      struct vkb_error *error);

// Whether a graph of `planned` finds in the data of `given` all that it reads, of the same sizes
// and formats.
bool vkb_source_matches(const struct vkb_source *planned, const struct vkb_source *given);

// Whether a graph of `planned` can run with the data of `given`: both need the same size and
// format, and the same optional parts. A graph of a scene depends on its camera, too.
bool vkb_source_fits(const struct vkb_source *planned, const struct vkb_source *given);

#endif
