// Validated devices in several threads, each of which leaves a number of its own of fences behind:
// prints "ok" where each got exactly the messages about its own.
#include "vulkan/device.h"

#include <pthread.h>
#include <stdio.h>
#include <string.h>

enum { THREADS = 4, ROUNDS = 6 };

static bool create_fence(const struct vkb_device *device, VkStructureType type)
{
    VkFence fence;

    return device->vk.vkCreateFence(device->handle, &(VkFenceCreateInfo){.sType = type}, NULL,
                                    &fence)
        == VK_SUCCESS;
}

static const char *leave_fences(struct vkb_device *device, unsigned count)
{
    struct vkb_error error;

    if (!vkb_device_create(device, 0, "", true, &error))
        return "cannot be created";
    const struct vkb_messages *before = vkb_messages_begin(&device->messages);
    for (unsigned i = 0; i < count; ++i)
        create_fence(device, VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
    vkb_messages_end(before);
    if (!vkb_messages_check(&device->messages, &error))
        return "has messages while it is right";
    vkb_device_destroy(device);
    if (device->messages.count != count)
        return "has another number of messages";
    if (vkb_messages_check(&device->messages, &error) != (count == 0))
        return "does not say so";
    return count == 0 || strstr(error.message, "has not been destroyed") ? NULL : "has other words";
}

struct worker {
    struct vkb_device device;
    unsigned fences;
    const char *wrong;
};

static void *work(void *argument)
{
    struct worker *worker = argument;

    for (unsigned round = 0; !worker->wrong && round < ROUNDS; ++round)
        worker->wrong = leave_fences(&worker->device, worker->fences);
    return NULL;
}

// Sections nest, and what nobody called for is not lost.
static const char *use_two(void)
{
    static struct vkb_device one, other;
    struct vkb_error error;

    if (!vkb_device_create(&one, 0, "", true, &error)
        || !vkb_device_create(&other, 0, "", true, &error))
        return "cannot be created";
    const struct vkb_messages *outer = vkb_messages_begin(&one.messages);
    const struct vkb_messages *inner = vkb_messages_begin(&other.messages);
    create_fence(&one, VK_STRUCTURE_TYPE_EVENT_CREATE_INFO);
    vkb_messages_end(inner);
    if (!vkb_messages_check(&one.messages, &error) || vkb_messages_check(&other.messages, &error))
        return "the inner section has no messages";
    create_fence(&other, VK_STRUCTURE_TYPE_EVENT_CREATE_INFO);
    vkb_messages_end(outer);
    if (vkb_messages_check(&one.messages, &error) || !vkb_messages_check(&other.messages, &error))
        return "the outer section has no messages";
    create_fence(&one, VK_STRUCTURE_TYPE_EVENT_CREATE_INFO);
    if (vkb_messages_check(&one.messages, &error) || vkb_messages_check(&other.messages, &error))
        return "a message without a section is lost";
    return NULL;
}

int main(void)
{
    static struct worker workers[THREADS];
    pthread_t threads[THREADS];
    const char *wrong = NULL;

    for (unsigned i = 0; i < THREADS; ++i) {
        workers[i].fences = i;
        pthread_create(&threads[i], NULL, work, &workers[i]);
    }
    for (unsigned i = 0; i < THREADS; ++i) {
        pthread_join(threads[i], NULL);
        wrong = wrong ? wrong : workers[i].wrong;
    }
    wrong = wrong ? wrong : use_two();
    puts(wrong ? wrong : "ok");
    return wrong != NULL;
}
