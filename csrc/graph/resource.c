#include "graph/resource.h"

#include "vulkan/error.h"

struct vkb_owner *vkb_owner_create(struct vkb_error *error)
{
    struct vkb_owner *owner = vkb_alloc(error, 1, sizeof *owner);

    if (owner) {
        atomic_init(&owner->holders, 1);
        atomic_init(&owner->gone, false);
    }
    return owner;
}

struct vkb_owner *vkb_owner_hold(struct vkb_owner *owner)
{
    if (owner)
        atomic_fetch_add(&owner->holders, 1);
    return owner;
}

void vkb_owner_release(struct vkb_owner *owner)
{
    if (owner && atomic_fetch_sub(&owner->holders, 1) == 1)
        vkb_free(owner);
}

void vkb_owner_leave(struct vkb_owner *owner)
{
    atomic_store(&owner->gone, true);
    vkb_owner_release(owner);
}
