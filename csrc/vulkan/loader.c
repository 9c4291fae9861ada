// volk's implementation, compiled once: it opens the Vulkan loader at run time.
#define VOLK_IMPLEMENTATION
#include <volk.h>
