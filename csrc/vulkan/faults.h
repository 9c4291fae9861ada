// Only in test builds (VKBLOOM_FAULTS): the n-th Vulkan call or allocation fails. Compiled in, not
// chosen at run time, so that what is shipped pays nothing and cannot be told to fail.
#ifndef VKB_FAULTS_H
#define VKB_FAULTS_H

#include <stdbool.h>
#include <vulkan/vulkan_core.h>

// Whether the call of that text ("vkb_alloc": an allocation) is the one to fail. It is not made
// then.
bool vkb_fault(const char *call_text);
// What it answers.
extern VkResult vkb_fault_result;

// Blocks of vkb_alloc and vkb_grow that are there, and validation messages that ever came: also
// those that no device got.
void vkb_fault_blocks(int more);
void vkb_fault_message(void);

// Destroys the instances, which no device may use any more: the next ones are made anew.
void vkb_fault_forget_instances(void);

#endif
