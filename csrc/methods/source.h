// What a graph starts from: a source without its data. Another kind of source takes a struct here,
// a case in each function of source.c, and the data that run/frame.c brings to the device.
#ifndef VKB_SOURCE_H
#define VKB_SOURCE_H

#include "methods/methods.h"

// Of the first kind there is nothing.
enum vkb_source_kind { VKB_SOURCE_NONE, VKB_SOURCE_IMAGE, VKB_SOURCE_SCENE };

struct vkb_source {
    enum vkb_source_kind kind;
    char shading[VKB_NAME_SIZE];  // of a scene
    union {
        struct vkb_image_source image;
        struct vkb_scene_source scene;
    };
};

// The graph of the source with those settings, as its method has it.
bool vkb_source_build(const struct vkb_source *source, const struct vkb_settings *settings,
                      uint32_t max_side, struct vkb_graph *graph, struct vkb_error *error);

// The sizes that the source's graph begins with: of the frame, and of its bloom buffers. A VALUE
// error where they are out of range.
bool vkb_source_sizes(const struct vkb_source *source, const struct vkb_settings *settings,
                      uint32_t max_side, struct vkb_size *frame, struct vkb_size *buffers,
                      struct vkb_error *error);

// Whether a graph of `planned` can run on the data of `given`: what has to be there is. What
// parameters hold, such as the camera and the time, is the graph's.
bool vkb_source_fits(const struct vkb_source *planned, const struct vkb_source *given);

#endif
