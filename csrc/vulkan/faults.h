// Only in test builds (VKBLOOM_FAULTS): the n-th Vulkan call or allocation fails. This is a
// compile-time switch, so that the shipped core has no cost and no way to fail on request.
#ifndef VKB_FAULTS_H
#define VKB_FAULTS_H

#include <stdbool.h>
#include <vulkan/vulkan_core.h>

// Whether the call with this text ("vkb_alloc": an allocation) must fail. If so, it is not made.
bool vkb_fault(const char *call_text);
// The result of the failing call.
extern VkResult vkb_fault_result;

// Count the memory blocks of vkb_alloc and vkb_grow, and all validation messages, including those
// that no device received.
void vkb_fault_blocks(int more);
void vkb_fault_message(void);

// Destroys the instances, which no device may use. The next use creates them again.
void vkb_fault_forget_instances(void);

#endif
