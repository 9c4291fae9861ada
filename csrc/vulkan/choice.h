// Which adapter a choice selects: "auto", "software", "hardware", "uuid:" with the beginning of a
// UUID, "pci:" with an address, or a part of a name. Where CUDA_VISIBLE_DEVICES is set, of NVIDIA's
// GPUs only the first that it names is selected, unless the choice is a UUID or an address.
#ifndef VKB_CHOICE_H
#define VKB_CHOICE_H

#include "vulkan/adapter.h"

// Opens the instance of the adapter that `choice` selects. `driver` is the path of a
// bundled driver; "" means none. The bundled software adapter takes precedence over the system's;
// for "software" the system's drivers are then not opened. On failure no instance is left open.
bool vkb_adapter_open(const char *choice, const char *driver, bool validation,
                      struct vkb_instance **instance, struct vkb_adapter_info *chosen,
                      struct vkb_error *error);

#endif
