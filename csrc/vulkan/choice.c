#include "vulkan/choice.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NVIDIA = 0x10de };

int vkb_adapter_preference(const struct vkb_adapter_info *adapter)
{
    switch (adapter->device_type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
        return 0;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
        return 1;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
        return 2;
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
        return 3;
    default:
        return 4;
    }
}

static bool is_cpu(const struct vkb_adapter_info *adapter)
{
    return adapter->device_type == VK_PHYSICAL_DEVICE_TYPE_CPU;
}

static bool contains(const char *text, const char *part)
{
    for (; *text; ++text) {
        size_t i = 0;
        while (part[i] && tolower((unsigned char)text[i]) == tolower((unsigned char)part[i]))
            ++i;
        if (!part[i])
            return true;
    }
    return false;
}

// What follows the prefix, which is in any case; NULL: the text starts otherwise.
static const char *after(const char *text, const char *prefix)
{
    for (; *prefix; ++text, ++prefix)
        if (tolower((unsigned char)*text) != *prefix)
            return NULL;
    return text;
}

// Whether the text, up to `end`, is the beginning of the UUID: with "GPU-" before it, as nvidia-smi
// prints it, or without, and with or without dashes.
static bool begins_uuid(const struct vkb_adapter_info *adapter, const char *text, const char *end)
{
    const char *number = after(text, "gpu-");
    char digits[VKB_UUID_TEXT_SIZE];
    const char *next = digits;
    bool any = false;

    vkb_uuid_text(adapter->uuid, digits);
    for (text = number ? number : text; text < end; ++text) {
        if (*text == '-')
            continue;
        next += *next == '-';
        if (tolower((unsigned char)*text) != *next)
            return false;
        any = true;
        ++next;
    }
    return any;
}

// Whether two addresses are equal: "0000:3b:00.0", with a domain of any length or none.
static bool is_address(const char *pci, const char *text)
{
    unsigned a[4], b[4];
    int end = 0;

    if (sscanf(text, "%8x:%2x:%2x.%1x%n", &b[0], &b[1], &b[2], &b[3], &end) != 4 || text[end]) {
        b[0] = 0;
        if (sscanf(text, "%2x:%2x.%1x%n", &b[1], &b[2], &b[3], &end) != 3 || text[end])
            return false;
    }
    return sscanf(pci, "%x:%x:%x.%x", &a[0], &a[1], &a[2], &a[3]) == 4
        && memcmp(a, b, sizeof a) == 0;
}

static bool is_one_device(const char *choice)
{
    return after(choice, "uuid:") || after(choice, "pci:");
}

static bool is_name(const char *choice)
{
    return strcmp(choice, "auto") != 0 && strcmp(choice, "software") != 0
        && strcmp(choice, "hardware") != 0 && !is_one_device(choice);
}

static bool fits(const struct vkb_adapter_info *adapter, const char *choice)
{
    const char *uuid = after(choice, "uuid:"), *pci = after(choice, "pci:");

    if (uuid)
        return begins_uuid(adapter, uuid, uuid + strlen(uuid));
    if (pci)
        return is_address(adapter->pci, pci);
    if (strcmp(choice, "auto") == 0)
        return true;
    if (strcmp(choice, "software") == 0)
        return is_cpu(adapter);
    if (strcmp(choice, "hardware") == 0)
        return !is_cpu(adapter);
    return contains(adapter->name, choice);
}

static bool same_name(const struct vkb_adapter_info *a, const struct vkb_adapter_info *b)
{
    return strcmp(a->name, b->name) == 0;
}

// How many GPUs CUDA counts before this one: by address, if CUDA_DEVICE_ORDER says so or all have
// one name. Otherwise CUDA counts the fastest first, which only it knows; Vulkan's order stands for
// it.
static uint32_t cuda_index(const struct vkb_adapter_info *adapters, uint32_t count, uint32_t at)
{
    const char *order = getenv("CUDA_DEVICE_ORDER");
    bool by_address = order && strcmp(order, "PCI_BUS_ID") == 0, equal = true;
    uint32_t before = 0;

    for (uint32_t i = 0; i < count; ++i)
        equal = equal && (adapters[i].vendor != NVIDIA || same_name(&adapters[i], &adapters[at]));
    by_address = by_address || equal;
    for (uint32_t i = 0; i < count; ++i) {
        const int order_of_two = by_address ? strcmp(adapters[i].pci, adapters[at].pci) : 0;
        before +=
            adapters[i].vendor == NVIDIA && (order_of_two < 0 || (order_of_two == 0 && i < at));
    }
    return before;
}

// The GPU that CUDA_VISIBLE_DEVICES names first; `count`: none that is there.
static uint32_t visible(const struct vkb_adapter_info *adapters, uint32_t count, const char *list)
{
    const char *end;

    list += strspn(list, " ");
    end = list + strcspn(list, ", ");
    const size_t digits = strspn(list, "0123456789");
    for (uint32_t i = 0; i < count; ++i)
        if (adapters[i].vendor == NVIDIA
            && (digits > 0 && list + digits == end
                    ? cuda_index(adapters, count, i) == strtoul(list, NULL, 10)
                    : after(list, "gpu-") && begins_uuid(&adapters[i], list, end)))
            return i;
    return count;
}

static const char *limiting_list(const char *choice)
{
    return strcmp(choice, "software") == 0 || is_one_device(choice)
             ? NULL
             : getenv("CUDA_VISIBLE_DEVICES");
}

static bool has_nvidia(const struct vkb_adapter_info *adapters, uint32_t count)
{
    for (uint32_t i = 0; i < count; ++i)
        if (adapters[i].vendor == NVIDIA)
            return true;
    return false;
}

static bool fail_equal(const char *choice, const struct vkb_adapter_info *adapters, uint32_t count,
                       uint32_t best, struct vkb_error *error)
{
    char names[VKB_CHOICE_NAMES] = "", uuid[VKB_UUID_TEXT_SIZE];

    for (uint32_t i = 0; i < count; ++i)
        if (fits(&adapters[i], choice) && same_name(&adapters[i], &adapters[best]))
            vkb_choice_describe(choice, &adapters[i], names);
    vkb_uuid_text(adapters[best].uuid, uuid);
    return vkb_fail(error, VKB_ERROR_VALUE,
                    "adapter: \"%s\" fits several equal GPUs: %s. Name one, such as \"uuid:%s\", "
                    "or set CUDA_VISIBLE_DEVICES",
                    choice, names, uuid);
}

bool vkb_choice_best(const char *choice, const struct vkb_adapter_info *adapters, uint32_t count,
                     uint32_t *best, struct vkb_error *error)
{
    const char *list = has_nvidia(adapters, count) ? limiting_list(choice) : NULL;
    const uint32_t named = list ? visible(adapters, count, list) : count;

    *best = count;
    if (named < count && fits(&adapters[named], choice)) {
        *best = named;
        return true;
    }
    for (uint32_t i = 0; i < count; ++i)
        if (fits(&adapters[i], choice) && !(list && adapters[i].vendor == NVIDIA)
            && (*best == count
                || vkb_adapter_preference(&adapters[i]) < vkb_adapter_preference(&adapters[*best])))
            *best = i;
    for (uint32_t i = 0; *best < count && is_name(choice) && i < count; ++i)
        // Two drivers may offer one device.
        if (!is_cpu(&adapters[i]) && fits(&adapters[i], choice)
            && same_name(&adapters[i], &adapters[*best])
            && memcmp(adapters[i].uuid, adapters[*best].uuid, VK_UUID_SIZE) != 0)
            return fail_equal(choice, adapters, count, *best, error);
    return true;
}

void vkb_choice_describe(const char *choice, const struct vkb_adapter_info *adapter,
                         char names[VKB_CHOICE_NAMES])
{
    const size_t length = strlen(names);
    char uuid[VKB_UUID_TEXT_SIZE], place[VKB_UUID_TEXT_SIZE + VKB_PCI_SIZE + 16] = "";

    vkb_uuid_text(adapter->uuid, uuid);
    if (!is_cpu(adapter) || is_one_device(choice))
        snprintf(place, sizeof place, ", uuid:%s%s%s", uuid, adapter->pci[0] ? ", pci:" : "",
                 adapter->pci);
    snprintf(names + length, VKB_CHOICE_NAMES - length, "%s%s (%s%s%s)", length ? ", " : "",
             adapter->name, vkb_adapter_type(adapter), adapter->bundled ? ", bundled" : "", place);
}

const char *vkb_choice_hint(const char *choice)
{
    return limiting_list(choice) ? " among the GPUs that CUDA_VISIBLE_DEVICES names" : "";
}
