#include "execute/pipeline.h"

#include "scene/scene.h"
#include "spirv/specialize.h"
#include "vulkan/parts.h"

#include <string.h>

// Keys are compared byte by byte, so they have no padding.
struct pipeline_key {
    struct vkb_hash vertex, shader;
    // Of the targets; the depth is the last.
    enum vkb_format formats[VKB_MAX_TARGETS + 1];
    uint32_t geometry;         // enum vkb_geometry
    uint32_t textured, blend;  // enum vkb_blend
    uint32_t layout;           // the number of the layouts
    // An even number of integers, so that the key has no padding.
    uint32_t unused[1 + VKB_CONSTANT_COUNT % 2];
    struct vkb_constants constants;
};
_Static_assert(sizeof(struct pipeline_key)
                   == 2 * sizeof(struct vkb_hash)
                          + (VKB_MAX_TARGETS + 6 + VKB_CONSTANT_COUNT % 2 + VKB_CONSTANT_COUNT)
                                * sizeof(uint32_t),
               "a pipeline's key has padding");

#ifdef VKBLOOM_FAULTS
bool vkb_driver_folds;
#else
enum { vkb_driver_folds = false };
#endif

struct vkb_pipeline_entry {
    struct pipeline_key key;
    VkPipeline handle;
    uint64_t used;  // the last submission that used it
};

bool vkb_pipelines_create(const struct vkb_device *device, const void *cache_data,
                          size_t cache_size, struct vkb_pipelines *pipelines,
                          struct vkb_error *error)
{
    *pipelines = (struct vkb_pipelines){0};
    return VK(error, device->vk.vkCreatePipelineCache(
                         device->handle,
                         &(VkPipelineCacheCreateInfo){
                             .sType = VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO,
                             .initialDataSize = cache_size,
                             .pInitialData = cache_data,
                         },
                         NULL, &pipelines->cache));
}

void vkb_pipelines_destroy(const struct vkb_device *device, struct vkb_pipelines *pipelines)
{
    const struct VolkDeviceTable *vk = &device->vk;

    for (size_t i = 0; i < pipelines->entry_count; ++i)
        vk->vkDestroyPipeline(device->handle, pipelines->entries[i].handle, NULL);
    vkb_bindings_destroy(device, &pipelines->bindings);
    vk->vkDestroyPipelineCache(device->handle, pipelines->cache, NULL);
    vkb_free(pipelines->entries);
    *pipelines = (struct vkb_pipelines){0};
}

void vkb_pipelines_trim(const struct vkb_device *device, struct vkb_pipelines *pipelines,
                        const struct vkb_age *age)
{
    const size_t left = pipelines->entry_count > VKB_KEPT_PIPELINES ? VKB_KEPT_PIPELINES / 2
                                                                    : pipelines->entry_count;

    pipelines->now = age->now;
    while (pipelines->entry_count > left) {
        struct vkb_pipeline_entry *oldest = &pipelines->entries[0];
        for (size_t i = 1; i < pipelines->entry_count; ++i)
            if (pipelines->entries[i].used < oldest->used)
                oldest = &pipelines->entries[i];
        if (!vkb_is_old(oldest->used, age))
            return;
        device->vk.vkDestroyPipeline(device->handle, oldest->handle, NULL);
        --pipelines->entry_count;
        *oldest = pipelines->entries[pipelines->entry_count];
    }
}

bool vkb_pipelines_save(const struct vkb_device *device, const struct vkb_pipelines *pipelines,
                        void **data, size_t *size, struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &device->vk;

    *data = NULL;
    if (!VK(error, vk->vkGetPipelineCacheData(device->handle, pipelines->cache, size, NULL)))
        return false;
    *data = vkb_alloc(error, *size, 1);
    if (!*data)
        return false;
    if (VK(error, vk->vkGetPipelineCacheData(device->handle, pipelines->cache, size, *data)))
        return true;
    vkb_free(*data);
    *data = NULL;
    return false;
}

#define MAP_ENTRY(id, name, member) {id, offsetof(struct vkb_constants, member), sizeof(int32_t)},

static const VkSpecializationMapEntry map_entries[VKB_CONSTANT_COUNT] = {
    SPECIALIZATION_CONSTANTS(MAP_ENTRY)};

static VkSpecializationInfo specialization(const struct vkb_constants *constants)
{
    return (VkSpecializationInfo){
        .mapEntryCount = VKB_CONSTANT_COUNT,
        .pMapEntries = map_entries,
        .dataSize = sizeof *constants,
        .pData = constants,
    };
}

static VkPipelineShaderStageCreateInfo shader_stage(VkShaderStageFlagBits stage,
                                                    VkShaderModule module,
                                                    const VkSpecializationInfo *constants)
{
    return (VkPipelineShaderStageCreateInfo){
        .sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
        .stage = stage,
        .module = module,
        .pName = "main",
        .pSpecializationInfo = vkb_driver_folds ? constants : NULL,
    };
}

static bool create_module(const struct vkb_device *device, const struct vkb_shader *shader,
                          const struct vkb_constants *constants, VkShaderModule *module,
                          struct vkb_error *error)
{
    uint32_t *folded = NULL;
    size_t size = shader->size;

    if (!vkb_driver_folds && vkb_has_constants(shader)
        && !vkb_specialize(shader, constants, &folded, &size, error))
        return false;
    const bool done =
        VK(error,
           device->vk.vkCreateShaderModule(device->handle,
                                           &(VkShaderModuleCreateInfo){
                                               .sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO,
                                               .codeSize = size,
                                               .pCode = folded ? folded : shader->code,
                                           },
                                           NULL, module));
    vkb_free(folded);
    return done;
}

bool vkb_compute_create(const struct vkb_device *device, VkPipelineCache cache,
                        const struct vkb_shader *shader, const struct vkb_constants *constants,
                        VkPipelineLayout layout, VkPipeline *pipeline, struct vkb_error *error)
{
    const VkSpecializationInfo special = specialization(constants);
    VkShaderModule module;

    if (!create_module(device, shader, constants, &module, error))
        return false;
    const bool done =
        VK(error, device->vk.vkCreateComputePipelines(
                      device->handle, cache, 1,
                      &(VkComputePipelineCreateInfo){
                          .sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
                          .stage = shader_stage(VK_SHADER_STAGE_COMPUTE_BIT, module, &special),
                          .layout = layout,
                      },
                      NULL, pipeline));
    device->vk.vkDestroyShaderModule(device->handle, module, NULL);
    return done;
}

// The states of a graphics pipeline that are the same for all passes.
static const VkPipelineInputAssemblyStateCreateInfo triangles = {
    .sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO,
    .topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST,
};
static const VkPipelineViewportStateCreateInfo one_viewport = {
    .sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO,
    .viewportCount = 1,
    .scissorCount = 1,
};
static const VkPipelineMultisampleStateCreateInfo one_sample = {
    .sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO,
    .rasterizationSamples = VK_SAMPLE_COUNT_1_BIT,
};
static const VkPipelineDynamicStateCreateInfo dynamic_viewport = {
    .sType = VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO,
    .dynamicStateCount = 2,
    .pDynamicStates = (const VkDynamicState[]){VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR},
};

static VkPipelineVertexInputStateCreateInfo vertex_input(const struct vkb_pass_row *pass)
{
    const bool is_mesh = vkb_is_mesh(pass->geometry);

    return (VkPipelineVertexInputStateCreateInfo){
        .sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO,
        .vertexBindingDescriptionCount = pass->textured ? VKB_VERTEX_BINDINGS : is_mesh,
        .pVertexBindingDescriptions = vkb_vertex_bindings,
        .vertexAttributeDescriptionCount =
            pass->textured ? VKB_TEXTURED_ATTRIBUTES : is_mesh * VKB_VERTEX_ATTRIBUTES,
        .pVertexAttributeDescriptions = vkb_vertex_attributes,
    };
}

static VkPipelineRasterizationStateCreateInfo rasterization(enum vkb_geometry geometry)
{
    return (VkPipelineRasterizationStateCreateInfo){
        .sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO,
        .polygonMode = VK_POLYGON_MODE_FILL,
        .cullMode = vkb_is_mesh(geometry) ? VK_CULL_MODE_BACK_BIT : VK_CULL_MODE_NONE,
        .frontFace = VK_FRONT_FACE_COUNTER_CLOCKWISE,
        .lineWidth = 1.0f,
    };
}

static VkPipelineDepthStencilStateCreateInfo depth_test(enum vkb_geometry geometry)
{
    return (VkPipelineDepthStencilStateCreateInfo){
        .sType = VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO,
        .depthTestEnable = geometry != VKB_GEOMETRY_FULLSCREEN,
        .depthWriteEnable = vkb_is_mesh(geometry),
        .depthCompareOp = VK_COMPARE_OP_LESS_OR_EQUAL,
    };
}

// Colours are added. VKB_BLEND_ADD keeps the target's alpha: the forward system's SRC_ALPHA,
// DST_ALPHA does the same for an alpha of 1 in rgba8unorm, but gives an alpha of 2 in a float
// format.
static VkPipelineColorBlendAttachmentState blending(enum vkb_blend blend)
{
    return (VkPipelineColorBlendAttachmentState){
        .blendEnable = blend != VKB_BLEND_NONE,
        .srcColorBlendFactor = VK_BLEND_FACTOR_ONE,
        .dstColorBlendFactor = VK_BLEND_FACTOR_ONE,
        .colorBlendOp = VK_BLEND_OP_ADD,
        .srcAlphaBlendFactor =
            blend == VKB_BLEND_ADD_RGBA ? VK_BLEND_FACTOR_ONE : VK_BLEND_FACTOR_ZERO,
        .dstAlphaBlendFactor = VK_BLEND_FACTOR_ONE,
        .alphaBlendOp = VK_BLEND_OP_ADD,
        .colorWriteMask = 0xf,
    };
}

static bool create_graphics(const struct vkb_device *device, const struct vkb_pipelines *pipelines,
                            const struct pipeline_key *key, const struct vkb_pass_row *pass,
                            const VkShaderModule modules[2], VkPipeline *pipeline,
                            struct vkb_error *error)
{
    const VkSpecializationInfo special = specialization(&pass->constants);
    const VkPipelineVertexInputStateCreateInfo vertices = vertex_input(pass);
    const VkPipelineRasterizationStateCreateInfo raster = rasterization(pass->geometry);
    const VkPipelineDepthStencilStateCreateInfo depth = depth_test(pass->geometry);
    VkPipelineColorBlendAttachmentState blends[VKB_MAX_TARGETS];
    VkFormat formats[VKB_MAX_TARGETS];

    for (uint32_t i = 0; i < pass->target_count; ++i) {
        blends[i] = blending(pass->blend);
        formats[i] = vkb_formats[key->formats[i]].vk;
    }
    return VK(
        error,
        device->vk.vkCreateGraphicsPipelines(
            device->handle, pipelines->cache, 1,
            &(VkGraphicsPipelineCreateInfo){
                .sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO,
                .pNext =
                    &(VkPipelineRenderingCreateInfo){
                        .sType = VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO,
                        .colorAttachmentCount = pass->target_count,
                        .pColorAttachmentFormats = formats,
                        .depthAttachmentFormat = vkb_formats[key->formats[VKB_MAX_TARGETS]].vk,
                    },
                .stageCount = 2,
                .pStages =
                    (VkPipelineShaderStageCreateInfo[]){
                        shader_stage(VK_SHADER_STAGE_VERTEX_BIT, modules[0], &special),
                        shader_stage(VK_SHADER_STAGE_FRAGMENT_BIT, modules[1], &special),
                    },
                .pVertexInputState = &vertices,
                .pInputAssemblyState = &triangles,
                .pViewportState = &one_viewport,
                .pRasterizationState = &raster,
                .pMultisampleState = &one_sample,
                .pDepthStencilState = &depth,
                .pColorBlendState =
                    &(VkPipelineColorBlendStateCreateInfo){
                        .sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO,
                        .attachmentCount = pass->target_count,
                        .pAttachments = blends,
                    },
                .pDynamicState = &dynamic_viewport,
                .layout = vkb_bindings_layouts(&pipelines->bindings, pass)->made.pipeline,
            },
            NULL, pipeline));
}

static bool create_pipeline(const struct vkb_device *device, const struct vkb_pipelines *pipelines,
                            const struct pipeline_key *key, const struct vkb_pass_row *pass,
                            VkPipeline *pipeline, struct vkb_error *error)
{
    // A driver copies what it needs of a module: none has to be kept.
    VkShaderModule modules[2] = {VK_NULL_HANDLE, VK_NULL_HANDLE};

    if (pass->geometry == VKB_GEOMETRY_DISPATCH)
        return vkb_compute_create(device, pipelines->cache, pass->shader, &pass->constants,
                                  vkb_bindings_layouts(&pipelines->bindings, pass)->made.pipeline,
                                  pipeline, error);
    const bool done = create_module(device, pass->vertex, &pass->constants, &modules[0], error)
                   && create_module(device, pass->shader, &pass->constants, &modules[1], error)
                   && create_graphics(device, pipelines, key, pass, modules, pipeline, error);
    for (int i = 0; i < 2; ++i)
        device->vk.vkDestroyShaderModule(device->handle, modules[i], NULL);
    return done;
}

// lavapipe compiles in this process, and ends it where that fails.
enum { COMPILE_MIB = 64 };

static bool has_room_to_compile(const struct vkb_device *device, struct vkb_error *error)
{
    if (device->adapter.device_type != VK_PHYSICAL_DEVICE_TYPE_CPU
        || vkb_require_room("compiling shaders", COMPILE_MIB, error))
        return true;
    vkb_add_words(error, ". %s", vkb_memory_hint);
    return false;
}

// Fills the key of a pass, whose layouts are created.
static bool make_key(const struct vkb_device *device, struct vkb_pipelines *pipelines,
                     const struct vkb_graph *graph, const struct vkb_pass_row *pass,
                     struct pipeline_key *key, struct vkb_error *error)
{
    const bool draws = pass->geometry != VKB_GEOMETRY_DISPATCH;

    memset(key, 0, sizeof *key);
    if (!vkb_bindings_prepare(device, &pipelines->bindings, pass, &key->layout, error))
        return false;
    key->vertex = vkb_shader_hash(pass->vertex);
    key->shader = vkb_shader_hash(pass->shader);
    key->geometry = pass->geometry;
    key->textured = pass->textured;
    key->blend = pass->blend;
    key->constants = pass->constants;
    for (uint32_t i = 0; draws && i < pass->target_count; ++i)
        key->formats[i] = graph->images[pass->targets[i]].format;
    if (pass->depth != VKB_NO_IMAGE)
        key->formats[VKB_MAX_TARGETS] = graph->images[pass->depth].format;
    return true;
}

static struct vkb_pipeline_entry *find_entry(const struct vkb_pipelines *pipelines,
                                             const struct pipeline_key *key)
{
    for (size_t i = 0; i < pipelines->entry_count; ++i)
        if (memcmp(&pipelines->entries[i].key, key, sizeof *key) == 0)
            return &pipelines->entries[i];
    return NULL;
}

// There is space for it.
static void add_entry(struct vkb_pipelines *pipelines, const struct pipeline_key *key,
                      VkPipeline handle)
{
    struct vkb_pipeline_entry *entry = &pipelines->entries[pipelines->entry_count++];

    memcpy(&entry->key, key, sizeof *key);
    entry->handle = handle;
    entry->used = pipelines->now;
    ++pipelines->created;
}

static bool make_space(struct vkb_pipelines *pipelines, size_t more, struct vkb_error *error)
{
    return vkb_grow(error, &pipelines->entries, &pipelines->entry_capacity,
                    pipelines->entry_count + more, sizeof *pipelines->entries);
}

bool vkb_pipelines_get(const struct vkb_device *device, struct vkb_pipelines *pipelines,
                       const struct vkb_graph *graph, const struct vkb_pass_row *pass,
                       VkPipeline *pipeline, struct vkb_error *error)
{
    struct pipeline_key key;

    if (!make_key(device, pipelines, graph, pass, &key, error))
        return false;
    struct vkb_pipeline_entry *entry = find_entry(pipelines, &key);
    if (entry) {
        *pipeline = entry->handle;
        entry->used = pipelines->now;
        return true;
    }
    if (!make_space(pipelines, 1, error) || !has_room_to_compile(device, error)
        || !create_pipeline(device, pipelines, &key, pass, pipeline, error))
        return false;
    add_entry(pipelines, &key, *pipeline);
    return true;
}

// A pipeline that does not exist yet.
struct missing {
    struct pipeline_key key;
    const struct vkb_pass_row *pass;
    VkPipeline handle;  // VK_NULL_HANDLE: it was not created
};

struct creation {
    struct vkb_device *device;
    const struct vkb_pipelines *pipelines;
    struct missing *missing;
};

static void create_part(void *context, uint32_t part, uint32_t first, uint32_t end)
{
    const struct creation *creation = context;
    const struct vkb_messages *before = vkb_messages_begin(&creation->device->messages);
    struct vkb_error error;

    (void)part;
    for (uint32_t i = first; i < end; ++i) {
        struct missing *one = &creation->missing[i];
        if (!create_pipeline(creation->device, creation->pipelines, &one->key, one->pass,
                             &one->handle, &error))
            one->handle = VK_NULL_HANDLE;
    }
    vkb_messages_end(before);
}

// Finds the different pipelines of the rows that do not exist; returns their number.
static uint32_t find_missing(const struct vkb_device *device, struct vkb_pipelines *pipelines,
                             const struct vkb_graph *graph, const struct vkb_pass_row *rows,
                             uint32_t count, struct missing *missing)
{
    struct vkb_error error;
    uint32_t found = 0;

    for (uint32_t i = 0; i < count; ++i) {
        struct missing *one = &missing[found];
        uint32_t same = 0;
        if (!make_key(device, pipelines, graph, &rows[i], &one->key, &error))
            return 0;
        while (same < found && memcmp(&missing[same].key, &one->key, sizeof one->key) != 0)
            ++same;
        one->pass = &rows[i];
        found += same == found && !find_entry(pipelines, &one->key);
    }
    return found;
}

// Whether several may be compiled at the same time. (lavapipe ends the process where memory ends.)
static bool has_room_for_all(const struct vkb_device *device, uint32_t count)
{
    const uint32_t cores = vkb_core_count();
    const size_t threads = count < cores ? count : cores;

    return device->adapter.device_type != VK_PHYSICAL_DEVICE_TYPE_CPU
        || vkb_has_room(threads * COMPILE_MIB);
}

void vkb_pipelines_create_together(struct vkb_device *device, struct vkb_pipelines *pipelines,
                                   const struct vkb_graph *graph, const struct vkb_pass_row *rows,
                                   uint32_t count)
{
    struct vkb_error error;
    struct missing *missing = vkb_alloc(&error, count, sizeof *missing);
    const struct creation creation = {device, pipelines, missing};
    const uint32_t found =
        missing ? find_missing(device, pipelines, graph, rows, count, missing) : 0;

    if (found > 1 && has_room_for_all(device, found) && make_space(pipelines, found, &error)) {
        // The size makes each one a chunk of work.
        vkb_in_parts(device->workers, create_part, NULL, (void *)&creation, 0, found,
                     (size_t)found << 20);
        for (uint32_t i = 0; i < found; ++i)
            if (missing[i].handle)
                add_entry(pipelines, &missing[i].key, missing[i].handle);
    }
    vkb_free(missing);
}
