// The implementation of volk, which opens the Vulkan loader at run time.
#define VOLK_IMPLEMENTATION
#include <volk.h>
