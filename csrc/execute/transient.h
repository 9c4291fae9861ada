// Frames whose images take much of the device's memory. There an image takes over the memory of one
// whose content no later pass reads. Other frames keep all their images, so that later calls find
// what is not out of date.
#ifndef VKB_TRANSIENT_H
#define VKB_TRANSIENT_H

#include "execute/record.h"

// Whether the images of the only request of a submission share memory.
bool vkb_shares_memory(const struct vkb_device *device, const struct vkb_plan *plan,
                       uint32_t request_count);

// Gives alike images of the graph one usage, so that they fit each other.
void vkb_share_usages(struct vkb_run *run);

// Prepares the wanted images of run->request: those that have memory keep it, the others get a
// content without an image.
bool vkb_begin_sharing(struct vkb_run *run, struct vkb_error *error);

// Before the group of pass `first` is recorded: its targets that have no memory take over that of
// another image, or get new one.
bool vkb_share_targets(struct vkb_run *run, uint32_t first, struct vkb_error *error);

#endif
