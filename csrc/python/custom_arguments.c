// The passes of a settings object that bring their shaders, textures and buffers along, as Python
// packs them (_custom/rows.py). All functions return false with an exception set.
#include "python/arguments.h"
#include "python/module.h"

#include "spirv/instructions.h"

#include <stddef.h>
#include <string.h>

enum {
    PASS_SIZE = offsetof(struct vkb_custom_pass, shader),
    RESOURCE_SIZE = offsetof(struct vkb_resource, data),
    VKB_MAX_GROUPS = 65535,  // every device dispatches as many
    VKB_MAX_VERTICES = 1 << 16,
};

// What the rows of passes refer to; its content belongs to Python's objects.
struct vkb_pass_content {
    struct vkb_shader shader, vertex;
    struct vkb_resource resources[VKB_MAX_RESOURCES];
};

static bool copy_block(PyObject *block, void *to, Py_ssize_t size)
{
    const bool fits = PyBytes_Size(block) == size;

    if (fits)
        memcpy(to, PyBytes_AsString(block), (size_t)size);
    else
        PyErr_Format(PyExc_ValueError, "passes: a block of %zd bytes is needed, not of %zd", size,
                     PyBytes_Size(block));
    return fits;
}

static const char OWNER[] = "vkbloom.resource_owner";

static void leave(PyObject *capsule)
{
    vkb_owner_leave(PyCapsule_GetPointer(capsule, OWNER));
}

PyObject *vkb_resource_owner(PyObject *module, PyObject *unused)
{
    struct vkb_error error;
    struct vkb_owner *owner = vkb_owner_create(&error);

    (void)unused;
    if (!owner)
        return vkb_raise(vkb_module_state(module), &error);
    PyObject *capsule = PyCapsule_New(owner, OWNER, leave);
    if (!capsule)
        vkb_owner_leave(owner);
    return capsule;
}

// The bytes of a texel of a texture's format; 0: textures have no such format.
static uint32_t texel_size(uint32_t format)
{
    static const struct {
        uint32_t first, last, size;
    } rows[] = {
        {VK_FORMAT_R8_UNORM, VK_FORMAT_R8_SINT, 1},
        {VK_FORMAT_R8G8_UNORM, VK_FORMAT_R8G8_SINT, 2},
        {VK_FORMAT_R8G8B8A8_UNORM, VK_FORMAT_R8G8B8A8_SINT, 4},
        {VK_FORMAT_R16_UNORM, VK_FORMAT_R16_SFLOAT, 2},
        {VK_FORMAT_R16G16_UNORM, VK_FORMAT_R16G16_SFLOAT, 4},
        {VK_FORMAT_R16G16B16A16_UNORM, VK_FORMAT_R16G16B16A16_SFLOAT, 8},
        {VK_FORMAT_R32_UINT, VK_FORMAT_R32_SFLOAT, 4},
        {VK_FORMAT_R32G32_UINT, VK_FORMAT_R32G32_SFLOAT, 8},
        {VK_FORMAT_R32G32B32A32_UINT, VK_FORMAT_R32G32B32A32_SFLOAT, 16},
    };

    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; ++i)
        if (format >= rows[i].first && format <= rows[i].last)
            return rows[i].size;
    return 0;
}

static bool has_texels(const struct vkb_resource *resource)
{
    // Every device has textures with such sides.
    const uint32_t most = resource->dimensions == 3 ? 256 : 4096;
    const uint32_t width = resource->width, height = resource->height, depth = resource->depth;
    const uint64_t texel = texel_size(resource->format);

    return texel && width <= most && height <= most && depth <= most
        && resource->size == texel * width * height * depth;
}

static bool check_resource(const struct vkb_resource *resource, PyObject *data)
{
    const bool image = resource->kind < VKB_RESOURCE_KINDS && vkb_resource_is_image(resource);

    if (resource->kind >= VKB_RESOURCE_KINDS)
        return vkb_refuse("passes: the kind %u of a resource is not 0 to %d", resource->kind,
                          VKB_RESOURCE_KINDS - 1);
    if (resource->serial == 0 || resource->size == 0)
        return vkb_refuse("passes: the serial and the size of a resource must be at least 1");
    if (image
        && (resource->dimensions - 1 > 2 || !has_texels(resource)
            || (resource->dimensions < 2 && resource->height > 1)
            || (resource->dimensions < 3 && resource->depth > 1)
            || resource->border > VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE))
        return vkb_refuse("passes: a texture of %u x %u x %u in %u dimensions with %llu bytes of "
                          "the VkFormat %u is none",
                          resource->width, resource->height, resource->depth, resource->dimensions,
                          (unsigned long long)resource->size, resource->format);
    return data == Py_None || (uint64_t)PyBytes_Size(data) == resource->size
        || vkb_refuse("passes: a resource has %zd bytes, and its block says %llu",
                      PyBytes_Size(data), (unsigned long long)resource->size);
}

// (block, bytes or None[, owner or None])
static bool read_resource(PyObject *tuple, struct vkb_resource *resource)
{
    PyObject *block, *data, *owner = Py_None;

    if (!vkb_require_tuple(tuple, "passes")
        || !PyArg_ParseTuple(tuple, "SO|O:resource", &block, &data, &owner)
        || !copy_block(block, resource, RESOURCE_SIZE))
        return false;
    if (data != Py_None && !PyBytes_Check(data)) {
        PyErr_Format(PyExc_TypeError, "passes: %R is not bytes or None", data);
        return false;
    }
    resource->data = data == Py_None ? NULL : PyBytes_AsString(data);
    if (owner != Py_None && !PyCapsule_IsValid(owner, OWNER)) {
        PyErr_Format(PyExc_TypeError, "passes: %R is not an owner of resources or None", owner);
        return false;
    }
    resource->owner = owner == Py_None ? NULL : PyCapsule_GetPointer(owner, OWNER);
    return check_resource(resource, data);
}

// The header of SPIR-V and at least a word of it; the instructions' lengths are those of the code.
static bool check_code(const struct vkb_shader *shader)
{
    const size_t count = shader->size / sizeof *shader->code;
    size_t at = SPV_HEADER_WORDS;

    if (shader->size % sizeof *shader->code || count <= SPV_HEADER_WORDS
        || shader->code[0] != SPV_MAGIC)
        return vkb_refuse("passes: the code of %s is not SPIR-V", shader->name);
    while (at < count && shader->code[at] >> 16 && at + (shader->code[at] >> 16) <= count)
        at += shader->code[at] >> 16;
    if (at != count)
        return vkb_refuse("passes: the SPIR-V of %s ends within an instruction", shader->name);
    return (shader->threads[0] > 0 && shader->threads[1] > 0)
        || vkb_refuse("passes: %s has workgroups of %u x %u threads, which must be at least 1",
                      shader->name, shader->threads[0], shader->threads[1]);
}

// Refers to the code and copies its hash.
static bool read_code(PyObject *code, PyObject *hash, struct vkb_shader *shader)
{
    shader->code = (const void *)PyBytes_AsString(code);
    shader->size = (size_t)PyBytes_Size(code);
    return copy_block(hash, shader->hash.bytes, sizeof shader->hash.bytes) && check_code(shader);
}

static bool check_pass(const struct vkb_custom_pass *pass)
{
    if (pass->read_count > VKB_MAX_READS)
        return vkb_refuse("passes: %u images read are more than %d", pass->read_count,
                          VKB_MAX_READS);
    if (!memchr(pass->name, 0, sizeof pass->name))
        return vkb_refuse("passes: a name is longer than %d bytes", VKB_NAME_SIZE - 1);
    for (uint32_t i = 0; i < pass->read_count; ++i)
        if (!memchr(pass->reads[i], 0, sizeof pass->reads[i]))
            return vkb_refuse("passes: a name is longer than %d bytes", VKB_NAME_SIZE - 1);
    for (uint32_t i = 0; i < VKB_MAX_READS; ++i)
        if (pass->sampling[i] >= VKB_SAMPLINGS)
            return vkb_refuse("passes: %u is no sampling", pass->sampling[i]);
    if (pass->format > VKB_FORMAT_RGBA8_SRGB)
        return vkb_refuse("passes: %u is no format of an image", pass->format);
    if (!pass->groups_width != !pass->groups_height || pass->groups_width > VKB_MAX_GROUPS
        || pass->groups_height > VKB_MAX_GROUPS)
        return vkb_refuse("passes: %u x %u workgroups are none, or more than %d along a side",
                          pass->groups_width, pass->groups_height, VKB_MAX_GROUPS);
    if (pass->vertices > VKB_MAX_VERTICES)
        return vkb_refuse("passes: %u vertices are more than %d", pass->vertices, VKB_MAX_VERTICES);
    return !pass->block_width == !pass->block_height
        || vkb_refuse("passes: a workgroup of %u x %u pixels is none", pass->block_width,
                      pass->block_height);
}

// (block, name of the shader, its SPIR-V, its hash, its threads along x and y, its bytes of shared
// memory, (resource, ...)[, SPIR-V and hash of a vertex shader])
static bool read_pass(PyObject *tuple, struct vkb_pass_content *content,
                      struct vkb_custom_pass *pass)
{
    struct vkb_shader *shader = &content->shader;
    PyObject *block, *code, *hash, *resources, *vertex = NULL, *vertex_hash = NULL;

    if (!vkb_require_tuple(tuple, "passes")
        || !PyArg_ParseTuple(tuple, "SsSSIIIO!|SS:core_passes", &block, &shader->name, &code, &hash,
                             &shader->threads[0], &shader->threads[1], &shader->shared,
                             &PyTuple_Type, &resources, &vertex, &vertex_hash)
        || !copy_block(block, pass, PASS_SIZE) || !read_code(code, hash, shader)
        || !check_pass(pass))
        return false;
    pass->shader = shader;
    if (vertex_hash) {
        content->vertex = (struct vkb_shader){.name = shader->name, .threads = {1, 1}};
        pass->vertex = &content->vertex;
        if (!read_code(vertex, vertex_hash, &content->vertex))
            return false;
    }
    if (PyTuple_Size(resources) > VKB_MAX_RESOURCES)
        return vkb_refuse("passes: %zd textures and buffers are more than %d",
                          PyTuple_Size(resources), VKB_MAX_RESOURCES);
    for (; pass->resource_count < PyTuple_Size(resources); ++pass->resource_count) {
        struct vkb_resource *resource = &content->resources[pass->resource_count];
        pass->resources[pass->resource_count] = resource;
        if (!read_resource(PyTuple_GetItem(resources, pass->resource_count), resource))
            return false;
    }
    return true;
}

static bool read_passes(struct vkb_held_passes *held, struct vkb_settings *settings)
{
    struct vkb_error error;

    if (!vkb_require_tuple(held->tuple, "passes"))
        return false;
    const Py_ssize_t count = PyTuple_Size(held->tuple);
    held->rows = vkb_alloc(&error, (size_t)count + 1, sizeof *held->rows);
    held->content = vkb_alloc(&error, (size_t)count + 1, sizeof *held->content);
    if (!held->rows || !held->content) {
        PyErr_NoMemory();
        return false;
    }
    settings->passes = held->rows;
    for (; settings->pass_count < count; ++settings->pass_count)
        if (!read_pass(PyTuple_GetItem(held->tuple, settings->pass_count),
                       &held->content[settings->pass_count], &held->rows[settings->pass_count]))
            return false;
    return count == 0 || !held->rows[0].joined
        || vkb_refuse("passes: the first one is joined to none");
}

bool vkb_hold_passes(const struct vkb_module_state *state, PyObject *object, uint32_t max_side,
                     const struct vkb_source *source, struct vkb_held_passes *held,
                     struct vkb_settings *settings)
{
    struct vkb_size frame, buffers;
    struct vkb_error error = {0};

    if (!vkb_method_of(settings)->custom || !settings->values.bloom)
        return true;
    if (!vkb_source_sizes(source, settings, max_side, &frame, &buffers, &error)) {
        vkb_raise(state, &error);
        return false;
    }
    held->tuple = PyObject_CallMethod(object, "core_passes", "(II)(II)", frame.width, frame.height,
                                      buffers.width, buffers.height);
    return held->tuple && read_passes(held, settings);
}

void vkb_release_passes(struct vkb_held_passes *held)
{
    Py_CLEAR(held->tuple);
    vkb_free(held->rows);
    vkb_free(held->content);
    held->rows = NULL;
    held->content = NULL;
}
