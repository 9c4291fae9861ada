#include "share/exported_images.h"

#include <limits.h>
#include <string.h>

static size_t element_size(enum vkb_format format)
{
    return vkb_formats[format].channel_size;
}

static bool is_float(enum vkb_format format)
{
    return format != VKB_FORMAT_RGBA8_UNORM;
}

// Whether dispatches access images. On a CPU, copies are faster.
static bool dispatches(const struct vkb_device *device)
{
    return device->dispatch && !device->linear_texels;
}

// Whether the rows can be copied to an image as they are.
static bool is_direct(const struct vkb_device *device, const struct vkb_input *input)
{
    const ptrdiff_t pixel = (ptrdiff_t)vkb_pixel_size(input->format);

    return !dispatches(device) && input->channels == vkb_formats[input->format].channels
        && vkb_input_is_contiguous(input) && input->row_stride >= pixel * (ptrdiff_t)input->width
        && input->row_stride % pixel == 0 && input->offset % (size_t)pixel == 0
        && input->offset % 4 == 0;
}

// The bytes of the memory between which the elements lie.
struct span {
    VkDeviceSize start, end;
};

static struct span span_of(const struct vkb_device *device, const struct vkb_input *input)
{
    const ptrdiff_t reaches[] = {
        input->row_stride * (ptrdiff_t)(input->height - 1),
        input->pixel_stride * (ptrdiff_t)(input->width - 1),
        input->channel_stride * (ptrdiff_t)(input->channels - 1),
        input->layers ? input->layer_stride * (ptrdiff_t)(input->layers - 1) : 0,
    };
    const VkDeviceSize align = device->limits.minStorageBufferOffsetAlignment;
    ptrdiff_t first = (ptrdiff_t)input->offset,
              last = first + (ptrdiff_t)element_size(input->format);

    for (size_t i = 0; i < sizeof reaches / sizeof reaches[0]; ++i) {
        first += reaches[i] < 0 ? reaches[i] : 0;
        last += reaches[i] > 0 ? reaches[i] : 0;
    }
    return (struct span){(VkDeviceSize)first / align * align, ((VkDeviceSize)last + 3) / 4 * 4};
}

static VkDeviceSize larger(VkDeviceSize a, VkDeviceSize b)
{
    return a > b ? a : b;
}

// An invocation of strided_copy.glsl writes 16 bytes.
static VkDeviceSize whole_stores(VkDeviceSize size)
{
    return (size + 15) / 16 * 16;
}

static VkDeviceSize input_scratch(const struct vkb_device *device, const struct vkb_input *input)
{
    return dispatches(device) || is_direct(device, input)
             ? 0
             : (VkDeviceSize)input->width * input->height * vkb_pixel_size(input->format);
}

// Descriptors cover no more than the adapter's limit, and offsets in shaders have 32 bits.
static bool check_range(const struct vkb_device *device, const char *name, VkDeviceSize size,
                        const char *advice, struct vkb_error *error)
{
    const uint32_t range = device->limits.maxStorageBufferRange;

    return (size <= range && size <= INT_MAX)
        || vkb_fail(error, VKB_ERROR_VALUE,
                    "%s: its pixels lie in %.4g MiB of memory, and a dispatch of the adapter %s "
                    "reaches %.4g (maxStorageBufferRange); %s",
                    name, (double)size / (1 << 20), device->adapter.name,
                    (double)(range < INT_MAX ? range : INT_MAX) / (1 << 20), advice);
}

bool vkb_exported_check(const struct vkb_device *device, const struct vkb_input *input,
                        struct vkb_error *error)
{
    const struct span span = span_of(device, input);

    return check_range(device, "image", span.end - span.start,
                       "make it contiguous, or give it from the host", error)
        && check_range(device, "image", input_scratch(device, input), "give it from the host",
                       error);
}

static bool reads_image(const struct vkb_device *device, enum vkb_format format)
{
    return dispatches(device) && format != VKB_FORMAT_DEPTH32_FLOAT;
}

VkImageUsageFlags vkb_exported_usage(const struct vkb_device *device,
                                     const struct vkb_image_row *row, enum vkb_access access)
{
    return reads_image(device, row->format) ? vkb_access_usage(access) : 0;
}

static VkDeviceSize output_scratch(const struct vkb_device *device, const struct vkb_output *output)
{
    return reads_image(device, output->format) || vkb_readback_is_complete(output)
             ? 0
             : (VkDeviceSize)output->width * output->row_count * vkb_pixel_size(output->format);
}

// What the framebuffer takes in exported memory.
static VkDeviceSize exported_size(const struct vkb_run *run, const struct vkb_output *output)
{
    const uint32_t layers = run->graph->layers;

    return (VkDeviceSize)output->width * output->row_count * output->channels
             * element_size(output->format)
         + (layers ? (layers - 1) * (VkDeviceSize)output->layer_stride : 0);
}

static bool check_output(const struct vkb_run *run, uint32_t image, const struct vkb_output *output,
                         struct vkb_error *error)
{
    const VkDeviceSize scratch = output_scratch(run->device, output);
    const bool copied =
        !reads_image(run->device, output->format) && vkb_readback_is_complete(output);

    return copied
        || check_range(run->device, run->graph->images[image].name,
                       larger(scratch, exported_size(run, output)), "use device=\"host\"", error);
}

// Dispatches do not write to the scratch memory, nor do copies, before `last` has read it.
static void free_scratch(const struct vkb_run *run, enum vkb_access last)
{
    const VkCommandBuffer commands = run->submission->commands.buffer;

    vkb_barrier_record(run->device, commands, NULL, true, last, VKB_ACCESS_COPY_TARGET);
    vkb_barrier_record(run->device, commands, NULL, true, last, VKB_ACCESS_DISPATCH_STORED);
}

static bool copy_strided(struct vkb_run *run, const struct vkb_strided_copy_work *given,
                         struct vkb_error *error)
{
    const struct vkb_readback *readback = &run->submission->readback;
    struct vkb_strided_copy_work work = *given;

    work.counts = (VkDescriptorBufferInfo){
        readback->counts.handle,
        0,
        VKB_COUNTS_SIZE * (work.layers ? work.layers : 1),
    };
    if (!work.to.buffer)
        work.to = work.counts;
    // All add to the same counts.
    vkb_barrier_record(run->device, run->submission->commands.buffer, NULL, true,
                       VKB_ACCESS_DISPATCH_CHANGED, VKB_ACCESS_DISPATCH_CHANGED);
    return vkb_strided_copy_create(run->device, run->frame->pipelines.cache, work.kind,
                                   &run->frame->strided_copies, error)
        && vkb_strided_copy_record(run->device, &run->frame->strided_copies,
                                   run->submission->commands.buffer, run->submission->descriptors,
                                   &work, error);
}

// Whether each pixel can be read as words, without gaps.
static bool is_aligned(const struct vkb_input *input)
{
    const ptrdiff_t layer_stride = input->layers ? input->layer_stride : 0;

    return input->channels == 4 && input->channel_stride == (ptrdiff_t)element_size(input->format)
        && input->offset % 4 == 0 && input->row_stride % 4 == 0 && input->pixel_stride % 4 == 0
        && layer_stride % 4 == 0;
}

static bool copy_strided_input(struct vkb_run *run, const struct vkb_staged_input *staged,
                               bool stores, struct vkb_error *error)
{
    const struct vkb_input *input = staged->input;
    const struct vkb_image *image = &staged->image->image;
    static const uint32_t ones[] = {[1] = 255, [2] = 0x3c00, [4] = 0x3f800000};
    const struct span span = span_of(run->device, input);
    const uint32_t size = (uint32_t)element_size(input->format);
    const struct vkb_strided_copy_work work = {
        .kind = input->layers           ? VKB_STRIDED_COPY_TO_LAYERS
              : dispatches(run->device) ? VKB_STRIDED_COPY_TO_IMAGE
                                        : VKB_STRIDED_COPY_BUFFER,
        .layers = input->layers,
        .image = {.imageView = image->view,
                  .imageLayout = vkb_image_layout(image, VKB_ACCESS_DISPATCH_STORED)},
        .layout =
            {
                .offset = (int32_t)(input->offset - span.start),
                .row_stride = (int32_t)input->row_stride,
                .pixel_stride = (int32_t)input->pixel_stride,
                .channel_stride = (int32_t)input->channel_stride,
                .width = input->width,
                .height = input->height,
                .channels = vkb_formats[input->format].channels,
                .from_channels = input->channels,
                .size = size,
                .one = ones[size],
                .stores = stores,
                .is_float = is_float(input->format),
                .layer_stride = (int32_t)input->layer_stride,
                .aligned = is_aligned(input),
            },
        .from = {input->exported->buffer.handle, span.start, span.end - span.start},
        .to = {stores ? run->submission->readback.scratch.handle : VK_NULL_HANDLE, 0,
               stores && !dispatches(run->device) ? whole_stores(input_scratch(run->device, input))
                                                  : VK_WHOLE_SIZE},
    };

    return copy_strided(run, &work, error);
}

static void copy_to_image(struct vkb_run *run, const struct vkb_input *input,
                          struct vkb_image *image, bool direct)
{
    const VkCommandBuffer commands = run->submission->commands.buffer;
    const uint32_t pixel = (uint32_t)vkb_pixel_size(input->format);

    vkb_image_transition(run->device, commands, image, VKB_ACCESS_COPY_TARGET);
    run->device->vk.vkCmdCopyBufferToImage(
        commands,
        direct ? input->exported->buffer.handle : run->submission->readback.scratch.handle,
        image->handle, vkb_image_layout(image, VKB_ACCESS_COPY_TARGET), 1,
        &(VkBufferImageCopy){
            .bufferOffset = direct ? input->offset : 0,
            .bufferRowLength = direct ? (uint32_t)input->row_stride / pixel : 0,
            .imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1},
            .imageExtent = {image->width, image->height, 1},
        });
}

static bool record_input(struct vkb_run *run, struct vkb_staged_input *staged,
                         struct vkb_error *error)
{
    const VkCommandBuffer commands = run->submission->commands.buffer;
    const struct vkb_input *input = staged->input;
    const bool direct = is_direct(run->device, input), stores = staged->send && !direct;

    if (dispatches(run->device))
        vkb_image_transition(run->device, commands, &staged->image->image,
                             VKB_ACCESS_DISPATCH_STORED);
    if ((stores || is_float(input->format)) && !copy_strided_input(run, staged, stores, error))
        return false;
    if (!staged->send)
        return true;
    staged->image->content.valid = true;
    if (dispatches(run->device))
        return true;
    if (stores)
        vkb_barrier_record(run->device, commands, NULL, true, VKB_ACCESS_DISPATCH_STORED,
                           VKB_ACCESS_COPY_SOURCE);
    copy_to_image(run, input, &staged->image->image, direct);
    if (stores)
        free_scratch(run, VKB_ACCESS_COPY_SOURCE);
    return true;
}

bool vkb_exported_record_input(struct vkb_run *run, struct vkb_staged_input *staged,
                               struct vkb_error *error)
{
    const VkCommandBuffer commands = run->submission->commands.buffer;
    const VkBuffer buffer = staged->input->exported->buffer.handle;

    vkb_barrier_record_acquire(run->device, commands, buffer);
    if (!record_input(run, staged, error))
        return false;
    // CUDA may fill it again, and another submission acquire it.
    vkb_barrier_record_release(run->device, commands, buffer, VKB_ACCESS_ANY_READ);
    return true;
}

// The next exported output from `*output` of `*request` on; NULL: there is none. Both are advanced.
static struct vkb_export *next_output(const struct vkb_request *requests, uint32_t request_count,
                                      uint32_t *request, uint32_t *output)
{
    for (; *request < request_count; ++*request, *output = 0)
        while (*output < requests[*request].plan->output_count) {
            struct vkb_export *exported = requests[*request].outputs[(*output)++].exported;
            if (exported)
                return exported;
        }
    return NULL;
}

// Reserves what is between images and exported memory, if the requests use any, and the point at
// which the outputs are complete.
static bool prepare(struct vkb_run *run, struct vkb_request *requests, uint32_t request_count,
                    struct vkb_error *error)
{
    struct vkb_readback *readback = &run->submission->readback;
    const uint32_t layers = run->graph->layers;
    const VkDeviceSize counts_size =
        (VkDeviceSize)(layers ? layers : request_count) * VKB_COUNTS_SIZE;
    VkDeviceSize scratch = 0;

    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind)
        if (run->inputs[kind].input) {
            scratch = larger(scratch, input_scratch(run->device, run->inputs[kind].input));
            readback->counted = true;
        }
    for (uint32_t i = 0; i < request_count; ++i)
        for (uint32_t output = 0; output < requests[i].plan->output_count; ++output)
            if (requests[i].outputs[output].exported) {
                const struct vkb_output *one = &requests[i].outputs[output];
                if (!check_output(run, requests[i].plan->outputs[output], one, error))
                    return false;
                scratch = larger(scratch, output_scratch(run->device, one));
                readback->counted = true;
            }
    if (!readback->counted)
        return true;
    uint32_t request = 0, at = 0;
    const struct vkb_export *output = next_output(requests, request_count, &request, &at);
    if (output)
        vkb_export_signal(output, &run->sync.signals[VKB_EXTERNAL_CUDA]);
    if (!vkb_buffer_reserve(run->device, VKB_MEMORY_DEVICE, vkb_device_export_usage(),
                            whole_stores(scratch), &readback->scratch, error)
        || !vkb_buffer_reserve(run->device, VKB_MEMORY_READBACK, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                               counts_size, &readback->counts, error))
        return false;
    memset(readback->counts.mapped, 0, (size_t)counts_size);
    return vkb_buffer_flush(run->device, &readback->counts, error);
}

bool vkb_exported_wait(struct vkb_run *run, struct vkb_error *error)
{
    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind) {
        const struct vkb_input *input = run->inputs[kind].input;
        if (!input)
            continue;
        if (!vkb_export_filled(input->exported, error))
            return false;
        vkb_export_wait(input->exported, &run->sync.waits[VKB_EXTERNAL_CUDA]);
    }
    return true;
}

static bool finish(struct vkb_run *run, const struct vkb_request *requests, uint32_t request_count,
                   struct vkb_error *error)
{
    uint32_t request = 0, at = 0;
    struct vkb_export *output;

    (void)error;
    while ((output = next_output(requests, request_count, &request, &at)))
        output->drawn = run->sync.signals[VKB_EXTERNAL_CUDA].value;
    return true;
}

static bool copy_strided_image(struct vkb_run *run, struct vkb_image *image,
                               struct vkb_strided_copy_work *work, struct vkb_error *error)
{
    work->kind = work->layers ? VKB_STRIDED_COPY_FROM_LAYERS : VKB_STRIDED_COPY_FROM_IMAGE;
    vkb_image_transition(run->device, run->submission->commands.buffer, image,
                         VKB_ACCESS_DISPATCH_SAMPLED);
    work->image.imageView = image->view;
    work->image.imageLayout = vkb_image_layout(image, VKB_ACCESS_DISPATCH_SAMPLED);
    return vkb_bindings_sampler(run->device, &run->frame->pipelines.bindings, image->format,
                                &work->image.sampler, error)
        && copy_strided(run, work, error);
}

static bool record_output(struct vkb_run *run, struct vkb_image *image,
                          const struct vkb_output *output, struct vkb_error *error)
{
    const VkCommandBuffer commands = run->submission->commands.buffer;
    const bool from_image = reads_image(run->device, output->format);
    const bool copied = !from_image && vkb_readback_is_complete(output);
    const uint32_t size = (uint32_t)element_size(output->format);
    const uint32_t pixel = (uint32_t)vkb_pixel_size(output->format);
    struct vkb_strided_copy_work work = {
        .layout =
            {
                .row_stride = (int32_t)(output->width * pixel),
                .pixel_stride = (int32_t)pixel,
                .channel_stride = (int32_t)size,
                .width = output->width,
                .height = output->row_count,
                .channels = output->channels,
                .from_channels = output->channels,
                .size = size,
                .stores = true,
                .layer_stride = (int32_t)output->layer_stride,
            },
        .layers = run->graph->layers,
        .from = {run->submission->readback.scratch.handle, 0,
                 from_image || copied ? VK_WHOLE_SIZE
                                      : whole_stores(output_scratch(run->device, output))},
        .to = {output->exported->buffer.handle, 0, whole_stores(exported_size(run, output))},
    };

    if (from_image) {
        if (!copy_strided_image(run, image, &work, error))
            return false;
    } else {
        vkb_readback_copy(run->device, commands, image, output,
                          copied ? work.to.buffer : work.from.buffer, 0);
    }
    if (!from_image && !copied) {
        vkb_barrier_record(run->device, commands, NULL, true, VKB_ACCESS_COPY_TARGET,
                           VKB_ACCESS_DISPATCH_LOADED);
        if (!copy_strided(run, &work, error))
            return false;
        free_scratch(run, VKB_ACCESS_DISPATCH_LOADED);
    }
    vkb_barrier_record_release(run->device, commands, output->exported->buffer.handle,
                               copied ? VKB_ACCESS_COPY_TARGET : VKB_ACCESS_DISPATCH_STORED);
    return true;
}

static bool record(struct vkb_run *run, struct vkb_error *error)
{
    const struct vkb_plan *plan = run->request->plan;

    for (uint32_t i = 0; i < plan->output_count; ++i)
        if (run->request->outputs[i].exported
            && !record_output(run, &run->images[plan->outputs[i]]->image, &run->request->outputs[i],
                              error))
            return false;
    return true;
}

const struct vkb_sink vkb_cuda_sink = {prepare, record, finish};
