// Which adapter a choice selects: "auto", "software", "hardware", "uuid:" with the beginning of a
// UUID, "pci:" with an address, or a part of a name. Where CUDA_VISIBLE_DEVICES is set, of NVIDIA's
// GPUs only the first that it names is selected, unless the choice is a UUID or an address.
#ifndef VKB_CHOICE_H
#define VKB_CHOICE_H

#include "vulkan/adapter.h"

enum { VKB_CHOICE_NAMES = 1536 };

// The rank of an adapter for "auto"; lower is better.
int vkb_adapter_preference(const struct vkb_adapter_info *adapter);

// *best: the index of the adapter; `count`: none fits. Fails if a name fits several equal GPUs.
bool vkb_choice_best(const char *choice, const struct vkb_adapter_info *adapters, uint32_t count,
                     uint32_t *best, struct vkb_error *error);

// Adds the adapter to a list for messages.
void vkb_choice_describe(const char *choice, const struct vkb_adapter_info *adapter,
                         char names[VKB_CHOICE_NAMES]);

// What limits the choice, for messages; "": nothing.
const char *vkb_choice_hint(const char *choice);

#endif
