// The forms that passes run in: the same picture, in the way that a class of devices runs best.
#ifndef VKB_FORMS_H
#define VKB_FORMS_H

#include "graph/graph.h"

enum vkb_forms {
    VKB_FORMS_FRAGMENT,  // every pass as its method has it, drawn
    VKB_FORMS_CPU,
    VKB_FORMS_GPU,
    VKB_FORMS_COUNT,
};

// The forms of that name: "fragment", "cpu", "gpu", or "auto" for those that suit the device. A
// VALUE error where the name is none of these, or the device has no compute shaders that write
// images, without which there is only "fragment".
bool vkb_forms_by_name(const char *name, const struct vkb_device *device, enum vkb_forms *forms,
                       struct vkb_error *error);

// Gives each pass of a graph its form, within what the device can do.
bool vkb_forms_choose(enum vkb_forms forms, const struct vkb_device *device,
                      struct vkb_graph *graph, struct vkb_error *error);

#endif
