#include "vulkan/messages.h"

#include "vulkan/process.h"

#include <stdio.h>

static struct vkb_lock lock;           // protects the list and its elements
static struct vkb_messages *all_open;  // accessed with the lock
static _Thread_local const struct vkb_messages *current;

void vkb_messages_open(struct vkb_messages *messages)
{
    vkb_lock_acquire(&lock);
    messages->next = all_open;
    all_open = messages;
    vkb_lock_release(&lock);
}

void vkb_messages_close(struct vkb_messages *messages)
{
    vkb_lock_acquire(&lock);
    for (struct vkb_messages **link = &all_open; *link; link = &(*link)->next)
        if (*link == messages) {
            *link = messages->next;
            break;
        }
    vkb_lock_release(&lock);
}

const struct vkb_messages *vkb_messages_begin(const struct vkb_messages *messages)
{
    const struct vkb_messages *before = current;

    current = messages;
    return before;
}

void vkb_messages_end(const struct vkb_messages *before)
{
    current = before;
}

bool vkb_messages_check(struct vkb_messages *messages, struct vkb_error *error)
{
    vkb_lock_acquire(&lock);
    const bool none = messages->count == 0;
    if (!none)
        vkb_fail(error, VKB_ERROR_VALIDATION, "%s (%u validation messages in this call)",
                 messages->first, messages->count);
    messages->count = 0;
    vkb_lock_release(&lock);
    return none;
}

VKAPI_ATTR VkBool32 VKAPI_CALL vkb_messages_receive(
    VkDebugUtilsMessageSeverityFlagBitsEXT severity, VkDebugUtilsMessageTypeFlagsEXT types,
    const VkDebugUtilsMessengerCallbackDataEXT *data, void *unused)
{
    (void)severity;
    (void)types;
    (void)unused;
#ifdef VKBLOOM_FAULTS
    vkb_fault_message();
#endif
    vkb_lock_acquire(&lock);
    for (struct vkb_messages *messages = all_open; messages; messages = messages->next)
        if (!current || messages == current) {
            if (messages->count == 0)
                snprintf(messages->first, sizeof messages->first, "%s", data->pMessage);
            ++messages->count;
        }
    vkb_lock_release(&lock);
    return VK_FALSE;
}
