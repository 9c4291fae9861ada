// A Vulkan driver that is entered without the loader, by the interface that the loader uses.
#ifndef VKB_DRIVER_H
#define VKB_DRIVER_H

#include "vulkan/error.h"

#include <volk.h>

// The function that gives a driver's others; NULL on failure. The library stays open.
// Source: the Vulkan loader's documentation, LoaderDriverInterface.md.
PFN_vkGetInstanceProcAddr vkb_driver_open(const char *path, struct vkb_error *error);

#endif
