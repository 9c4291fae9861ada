#include "execute/limits.h"

#include "spirv/module.h"

#include <string.h>

struct need {
    const char *what, *limit;
    uint64_t needed, allowed;
};

static bool check(const struct vkb_device *device, const struct vkb_pass_row *pass,
                  const struct need *needs, size_t count, struct vkb_error *error)
{
    for (const struct need *need = needs; need < needs + count; ++need)
        if (need->needed > need->allowed)
            return vkb_fail(error, VKB_ERROR_VALUE,
                            "passes: %s needs %llu %s; the adapter %s allows %llu (%s)", pass->name,
                            (unsigned long long)need->needed, need->what, device->adapter.name,
                            (unsigned long long)need->allowed, need->limit);
    return true;
}

#define CHECK(...) \
    check(device, pass, (const struct need[]){__VA_ARGS__}, \
          sizeof((const struct need[]){__VA_ARGS__}) / sizeof(struct need), error)
#define LIMIT(name) #name, .allowed = device->limits.name

static bool check_bindings(const struct vkb_device *device, const struct vkb_pass_row *pass,
                           struct vkb_error *error)
{
    const bool dispatch = pass->geometry == VKB_GEOMETRY_DISPATCH;
    uint32_t counts[VKB_RESOURCE_KINDS] = {
        [VKB_RESOURCE_TEXTURE] = pass->read_count,
        [VKB_RESOURCE_IMAGE] = dispatch,  // the target
        [VKB_RESOURCE_UNIFORM] = 1,       // the parameters
    };

    for (uint32_t i = 0; i < pass->resource_count; ++i)
        ++counts[pass->resources[i]->kind];
    const uint32_t targets = dispatch ? 0 : pass->target_count;
    const uint32_t every = counts[VKB_RESOURCE_TEXTURE] + counts[VKB_RESOURCE_IMAGE]
                         + counts[VKB_RESOURCE_UNIFORM] + counts[VKB_RESOURCE_STORAGE] + targets;
    return CHECK(
        {"textures", LIMIT(maxPerStageDescriptorSampledImages),
         .needed = counts[VKB_RESOURCE_TEXTURE]},
        {"textures", LIMIT(maxPerStageDescriptorSamplers), .needed = counts[VKB_RESOURCE_TEXTURE]},
        {"storage images", LIMIT(maxPerStageDescriptorStorageImages),
         .needed = counts[VKB_RESOURCE_IMAGE]},
        {"uniform buffers", LIMIT(maxPerStageDescriptorUniformBuffers),
         .needed = counts[VKB_RESOURCE_UNIFORM]},
        {"storage buffers", LIMIT(maxPerStageDescriptorStorageBuffers),
         .needed = counts[VKB_RESOURCE_STORAGE]},
        {"outputs", LIMIT(maxFragmentCombinedOutputResources),
         .needed =
             dispatch ? 0 : counts[VKB_RESOURCE_IMAGE] + counts[VKB_RESOURCE_STORAGE] + targets},
        {"bindings", LIMIT(maxPerStageResources), .needed = every});
}

static uint64_t type_bytes(const struct vkb_module *module, uint32_t id, int depth);

static uint64_t struct_bytes(const struct vkb_module *module, const uint32_t *type, int depth)
{
    uint64_t size = 0;

    for (uint32_t i = 2; i < vkb_word_count(type); ++i)
        size += type_bytes(module, type[i], depth);
    return size;
}

// A size without padding; types that shared memory does not hold have none.
static uint64_t type_bytes(const struct vkb_module *module, uint32_t id, int depth)
{
    enum { MAX_DEPTH = 16 };  // a faulty module may name a type within itself
    const uint32_t *type = id < module->bound ? module->at[id] : NULL;
    uint32_t length;

    if (!type || depth > MAX_DEPTH)
        return 0;
    switch (vkb_opcode(type)) {
    case SPV_TYPE_BOOL:
        return sizeof(uint32_t);
    case SPV_TYPE_INT:
    case SPV_TYPE_FLOAT:
        return type[2] / 8;
    case SPV_TYPE_VECTOR:
    case SPV_TYPE_MATRIX:
        return type_bytes(module, type[2], depth + 1) * type[3];
    case SPV_TYPE_ARRAY:
        return module->at[type[3]] && vkb_constant(module, module->at[type[3]], &length)
                 ? type_bytes(module, type[2], depth + 1) * length
                 : 0;
    case SPV_TYPE_STRUCT:
        return struct_bytes(module, type, depth + 1);
    default:
        return 0;
    }
}

// What the module declares of a workgroup: its threads along each axis, and its shared memory.
static bool check_workgroup(const struct vkb_device *device, const struct vkb_pass_row *pass,
                            struct vkb_error *error)
{
    const VkPhysicalDeviceLimits *limits = &device->limits;
    uint32_t threads[3] = {1, 1, 1};
    uint64_t shared = 0;
    struct vkb_module module;
    const bool done = vkb_read_module(pass->shader, &module, error);

    for (const uint32_t *at = module.first; done && at < module.functions; at = vkb_next(at))
        if (vkb_opcode(at) == SPV_EXECUTION_MODE && vkb_word_count(at) == 6
            && at[2] == SPV_LOCAL_SIZE)
            memcpy(threads, at + 3, sizeof threads);
        else if (vkb_opcode(at) == SPV_VARIABLE && vkb_word_count(at) >= 4
                 && at[3] == SPV_WORKGROUP) {
            const uint32_t *pointer = at[1] < module.bound ? module.at[at[1]] : NULL;
            shared += pointer && vkb_opcode(pointer) == SPV_TYPE_POINTER
                        ? type_bytes(&module, pointer[3], 0)
                        : 0;
        }
    vkb_free(module.at);
    return done
        && CHECK({"threads of a workgroup", LIMIT(maxComputeWorkGroupInvocations),
                  .needed = (uint64_t)threads[0] * threads[1] * threads[2]},
                 {"threads along x", "maxComputeWorkGroupSize", threads[0],
                  limits->maxComputeWorkGroupSize[0]},
                 {"threads along y", "maxComputeWorkGroupSize", threads[1],
                  limits->maxComputeWorkGroupSize[1]},
                 {"threads along z", "maxComputeWorkGroupSize", threads[2],
                  limits->maxComputeWorkGroupSize[2]},
                 {"bytes of shared memory", LIMIT(maxComputeSharedMemorySize), .needed = shared});
}

bool vkb_limits_check(const struct vkb_device *device, const struct vkb_pass_row *pass,
                      struct vkb_error *error)
{
    return check_bindings(device, pass, error)
        && (pass->geometry != VKB_GEOMETRY_DISPATCH || check_workgroup(device, pass, error));
}
