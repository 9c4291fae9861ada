#include "vulkan/choice.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    NVIDIA = 0x10de,
    NAMES_SIZE = 1536,
};

// The rank of an adapter's type; lower is better.
static int type_rank(const struct vkb_adapter_info *adapter)
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

// The rank of an adapter for "auto". Drivers that say that they are not conformant come last.
static int preference(const struct vkb_adapter_info *adapter)
{
    enum { TYPES = 5 };

    return type_rank(adapter) + (adapter->nonconformant ? TYPES : 0);
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

// Adds the adapter to a list for messages.
static void add_name(const char *choice, const struct vkb_adapter_info *adapter,
                     char names[NAMES_SIZE])
{
    const size_t length = strlen(names);
    char uuid[VKB_UUID_TEXT_SIZE], place[VKB_UUID_TEXT_SIZE + VKB_PCI_SIZE + 16] = "";

    vkb_uuid_text(adapter->uuid, uuid);
    if (!is_cpu(adapter) || is_one_device(choice))
        snprintf(place, sizeof place, ", uuid:%s%s%s", uuid, adapter->pci[0] ? ", pci:" : "",
                 adapter->pci);
    snprintf(names + length, NAMES_SIZE - length, "%s%s (%s%s%s)", length ? ", " : "",
             adapter->name, vkb_adapter_type(adapter), adapter->bundled ? ", bundled" : "", place);
}

static bool fail_equal(const char *choice, const struct vkb_adapter_info *adapters, uint32_t count,
                       uint32_t best, struct vkb_error *error)
{
    char names[NAMES_SIZE] = "", uuid[VKB_UUID_TEXT_SIZE];

    for (uint32_t i = 0; i < count; ++i)
        if (fits(&adapters[i], choice) && same_name(&adapters[i], &adapters[best]))
            add_name(choice, &adapters[i], names);
    vkb_uuid_text(adapters[best].uuid, uuid);
    return vkb_fail(error, VKB_ERROR_VALUE,
                    "adapter: \"%s\" fits several equal GPUs: %s. Name one, such as \"uuid:%s\", "
                    "or set CUDA_VISIBLE_DEVICES",
                    choice, names, uuid);
}

// *best: the index of the adapter; `count`: none fits. Fails if a name fits several equal GPUs.
static bool choose(const char *choice, const struct vkb_adapter_info *adapters, uint32_t count,
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
            && (*best == count || preference(&adapters[i]) < preference(&adapters[*best])))
            *best = i;
    for (uint32_t i = 0; *best < count && is_name(choice) && i < count; ++i)
        // Two drivers may offer one device.
        if (!is_cpu(&adapters[i]) && fits(&adapters[i], choice)
            && same_name(&adapters[i], &adapters[*best])
            && memcmp(adapters[i].uuid, adapters[*best].uuid, VK_UUID_SIZE) != 0)
            return fail_equal(choice, adapters, count, *best, error);
    return true;
}

// What limits the choice, for messages.
static const char *hint(const char *choice)
{
    return limiting_list(choice) ? " among the GPUs that CUDA_VISIBLE_DEVICES names" : "";
}

// The best adapter of one source: the system's loader, or a driver without it.
struct source {
    struct vkb_instance *instance;
    struct vkb_adapter_info best;
    bool found;
};

// Opens the source, and finds the best adapter that fits; adds the names of all to the text.
static bool open_source(struct source *source, const char *choice, const char *driver,
                        bool validation, char (*names)[NAMES_SIZE], struct vkb_error *error)
{
    struct vkb_adapter_info adapters[VKB_MAX_ADAPTERS];
    uint32_t count, best;

    *source = (struct source){.instance = vkb_instance_open(driver, validation, error)};
    if (!source->instance || !vkb_adapters_list(source->instance, adapters, &count, error))
        return false;
    for (uint32_t i = 0; i < count; ++i)
        add_name(choice, &adapters[i], *names);
    if (!choose(choice, adapters, count, &best, error))
        return false;
    source->found = best < count;
    if (source->found)
        source->best = adapters[best];
    return true;
}

static void close_source(struct source *source)
{
    if (source->instance)
        vkb_instance_close(source->instance);
    *source = (struct source){0};
}

// Whether an adapter of the bundled driver, which is a CPU, would come before that one.
static bool is_last_resort(const struct source *source)
{
    return !source->found
        || preference(&source->best) >= preference(&(struct vkb_adapter_info){
               .device_type = VK_PHYSICAL_DEVICE_TYPE_CPU,
           });
}

// The system's adapters, then the driver's where it could be better. No system's adapter is no
// failure where there is a driver.
static bool open_sources(struct source *system, struct source *bundled, const char *choice,
                         const char *driver, bool validation, char (*names)[NAMES_SIZE],
                         struct vkb_error *error)
{
    if (!driver[0] || strcmp(choice, "software") != 0) {
        if (!open_source(system, choice, "", validation, names, error)
            && (!driver[0] || error->kind != VKB_ERROR_ADAPTER_NOT_FOUND))
            return false;
        if (!driver[0] || !is_last_resort(system))
            return true;
    }
    *error = (struct vkb_error){0};
    return open_source(bundled, choice, driver, validation, names, error);
}

bool vkb_adapter_open(const char *choice, const char *driver, bool validation,
                      struct vkb_instance **instance, struct vkb_adapter_info *chosen,
                      struct vkb_error *error)
{
    struct source system = {0}, bundled = {0};
    char names[NAMES_SIZE] = "";
    bool done = open_sources(&system, &bundled, choice, driver, validation, &names, error);
    struct source *best = bundled.found ? &bundled : &system;

    if (done && !best->found)
        done = vkb_fail(error, VKB_ERROR_ADAPTER_NOT_FOUND,
                        "no Vulkan adapter for \"%s\"%s; found: %s. %s", choice, hint(choice),
                        names[0] ? names : "none", vkb_install_hint);
    if (done) {
        *instance = best->instance;
        *chosen = best->best;
        best->instance = NULL;
    }
    close_source(&system);
    close_source(&bundled);
    return done;
}
