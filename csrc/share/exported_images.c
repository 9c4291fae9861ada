#include "share/exported_images.h"

#include <limits.h>
#include <string.h>

static size_t element_size(enum vkb_format format)
{
    return vkb_formats[format].channel_size;
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
                       "make it contiguous, or give it from the host", error);
}

// What the framebuffer takes in exported memory. strided_copy_from_image.comp writes words of 16
// bytes.
static VkDeviceSize exported_size(const struct vkb_run *run, const struct vkb_output *output)
{
    const uint32_t layers = run->graph->layers;
    const VkDeviceSize size = (VkDeviceSize)output->width * output->row_count * output->channels
                                * element_size(output->format)
                            + (layers ? (layers - 1) * (VkDeviceSize)output->layer_stride : 0);

    return (size + 15) / 16 * 16;
}

static bool copy_strided(struct vkb_run *run, struct vkb_strided_copy_work *work,
                         struct vkb_error *error)
{
    work->counts = (VkDescriptorBufferInfo){
        run->submission->readback.counts.handle,
        0,
        VKB_COUNTS_SIZE * (work->layers ? work->layers : 1),
    };
    // All add to the same counts.
    if (work->layout.non_finite == VKB_NON_FINITE_COUNTED)
        vkb_barrier_record(run->device, run->submission->commands.buffer, NULL, true,
                           VKB_ACCESS_DISPATCH_CHANGED, VKB_ACCESS_DISPATCH_CHANGED);
    return vkb_strided_copy_create(run->device, run->frame->pipelines.cache, work->kind,
                                   &run->frame->strided_copies, error)
        && vkb_strided_copy_record(run->device, &run->frame->strided_copies,
                                   run->submission->commands.buffer, &run->submission->descriptors,
                                   work, error);
}

static enum vkb_input_kind kind_of(const struct vkb_run *run, const struct vkb_staged_input *staged)
{
    return (enum vkb_input_kind)(staged - run->inputs);
}

// Whether each pixel can be read as words, without gaps.
static bool is_aligned(const struct vkb_input *input)
{
    const ptrdiff_t layer_stride = input->layers ? input->layer_stride : 0;

    return input->channels == 4 && input->channel_stride == (ptrdiff_t)element_size(input->format)
        && input->offset % 4 == 0 && input->row_stride % 4 == 0 && input->pixel_stride % 4 == 0
        && layer_stride % 4 == 0;
}

// The host refuses a depth of NaN and a motion that is not finite; of memory of the device it does
// not know them.
static enum vkb_non_finite_use non_finite_of(enum vkb_input_kind kind)
{
    return !vkb_is_grey(kind)      ? VKB_NON_FINITE_COUNTED
         : kind == VKB_INPUT_DEPTH ? VKB_NON_FINITE_NAN_IS_ZERO
                                   : VKB_NON_FINITE_IS_ZERO;
}

static bool copy_input(struct vkb_run *run, const struct vkb_staged_input *staged,
                       struct vkb_error *error)
{
    const struct vkb_input *input = staged->input;
    const struct vkb_image *image = &staged->image->image;
    const struct span span = span_of(run->device, input);
    struct vkb_strided_copy_work work = {
        .kind = input->layers ? VKB_STRIDED_COPY_TO_LAYERS : VKB_STRIDED_COPY_TO_IMAGE,
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
                .channels = input->channels,
                .size = (uint32_t)element_size(input->format),
                .stores = staged->send,
                .layer_stride = (int32_t)input->layer_stride,
                .aligned = is_aligned(input),
                .non_finite = non_finite_of(kind_of(run, staged)),
            },
        .from = {input->exported->buffer.handle, span.start, span.end - span.start},
    };

    return copy_strided(run, &work, error);
}

// Whether an input of the kinds from `first` to before `end` lies in that memory: both axes of a
// motion do.
static bool has_input(const struct vkb_run *run, const struct vkb_export *exported, int first,
                      int end)
{
    for (int kind = first; kind < end; ++kind)
        if (run->inputs[kind].input && run->inputs[kind].input->exported == exported)
            return true;
    return false;
}

bool vkb_exported_record_input(struct vkb_run *run, struct vkb_staged_input *staged,
                               struct vkb_error *error)
{
    const VkCommandBuffer commands = run->submission->commands.buffer;
    const struct vkb_export *exported = staged->input->exported;
    const VkBuffer buffer = exported->buffer.handle;
    const enum vkb_input_kind kind = kind_of(run, staged);
    // Non-finite elements are counted again in each submission, but not beside cotangents, of which
    // alone they are asked for.
    const bool counts = !vkb_is_grey(kind) && staged->input->format != VKB_FORMAT_RGBA8_UNORM
                     && (!run->inputs[VKB_INPUT_LEVEL].input || kind >= VKB_INPUT_LEVEL);

    if (!has_input(run, exported, 0, kind))
        vkb_barrier_record_owner(run->device, commands, buffer, VKB_ACCESS_NONE,
                                 VKB_ACCESS_DISPATCH_LOADED);
    vkb_image_transition(run->device, commands, &staged->image->image, VKB_ACCESS_DISPATCH_STORED);
    if ((staged->send || counts) && !copy_input(run, staged, error))
        return false;
    if (counts && kind == VKB_INPUT_IMAGE && !staged->input->layers)
        run->submission->readback.counted_version = staged->image->content.version;
    staged->image->content.valid = true;
    // CUDA may fill it again, and another submission acquire it.
    if (!has_input(run, exported, kind + 1, VKB_INPUT_COUNT))
        vkb_barrier_record_owner(run->device, commands, buffer, VKB_ACCESS_DISPATCH_LOADED,
                                 VKB_ACCESS_PRESENTED);
    return true;
}

void vkb_exported_take_counts(const struct vkb_device *device, struct vkb_frame *frame,
                              struct vkb_submission *submission)
{
    struct vkb_readback *readback = &submission->readback;
    const uint32_t *counts = readback->counts.mapped;
    struct vkb_error ignored;

    if (readback->counted_version && vkb_buffer_invalidate(device, &readback->counts, &ignored)
        && counts[0] == 0 && counts[1] == 0)
        frame->finite_version = readback->counted_version;
    readback->counted_version = 0;
}

// The forward pass of a training step has counted the image that the backward pass reads, which
// then need not look for pixels whose cotangents become 0: on an H200 a step takes 2.17 in place
// of 2.27 ms (a pyramid), 2.39 in place of 2.52 (DualKawase; 3840 x 2160, RGB in float32,
// 2026-11-30).
static void find_known_finite(struct vkb_run *run)
{
    const struct vkb_submissions *submissions = &run->frame->submissions;
    const struct vkb_staged_input *staged = &run->inputs[VKB_INPUT_IMAGE];

    for (size_t i = 0; i < submissions->count; ++i)
        if (!submissions->submissions[i]->pending)
            vkb_exported_take_counts(run->device, run->frame, submissions->submissions[i]);
    if (staged->input && !staged->send && !run->inputs[VKB_INPUT_EMISSION].input
        && staged->image->content.version == run->frame->finite_version)
        run->unknown_non_finite = false;
}

bool vkb_exported_fill(struct vkb_run *run, const struct vkb_frame_source *source,
                       struct vkb_error *error)
{
    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind) {
        const struct vkb_input *input = run->inputs[kind].input;
        if (!input)
            continue;
        if (input->exported->origin_size > 0
            && (!vkb_submissions_wait(run->device, &run->frame->submissions, error)
                || !source->fill(source->context, input->exported, error)))
            return false;
        vkb_export_wait(input->exported, &run->sync.waits[VKB_EXTERNAL_CUDA]);
    }
    find_known_finite(run);
    return true;
}

// The next exported output from `*output` of `*request` on; NULL: there is none. Both are advanced.
static struct vkb_export *next_output(const struct vkb_request *requests, uint32_t request_count,
                                      uint32_t *request, uint32_t *output)
{
    while (*request < request_count) {
        while (*output < requests[*request].plan->output_count) {
            struct vkb_export *exported = requests[*request].outputs[*output].exported;
            ++*output;
            if (exported)
                return exported;
        }
        ++*request;
        *output = 0;
    }
    return NULL;
}

// Depth is copied: no dispatch reads it.
static enum vkb_access output_access(enum vkb_format format)
{
    return format == VKB_FORMAT_DEPTH32_FLOAT ? VKB_ACCESS_COPY_SOURCE
                                              : VKB_ACCESS_DISPATCH_SAMPLED;
}

VkImageUsageFlags vkb_exported_usage(enum vkb_format format)
{
    return vkb_access_usage(output_access(format));
}

static bool is_copied(const struct vkb_output *output)
{
    return output_access(output->format) == VKB_ACCESS_COPY_SOURCE;
}

static bool check_outputs(const struct vkb_run *run, const struct vkb_request *request,
                          struct vkb_error *error)
{
    for (uint32_t i = 0; i < request->plan->output_count; ++i) {
        const struct vkb_output *output = &request->outputs[i];
        if (output->exported && !is_copied(output)
            && !check_range(run->device, run->graph->images[request->plan->outputs[i]].name,
                            exported_size(run, output), "use device=\"host\"", error))
            return false;
    }
    return true;
}

// Reserves the counts, if the requests use exported memory, and the point at which the outputs are
// complete.
static bool prepare(struct vkb_run *run, struct vkb_request *requests, uint32_t request_count,
                    struct vkb_error *error)
{
    struct vkb_readback *readback = &run->submission->readback;
    const uint32_t layers = run->graph->layers;
    const VkDeviceSize counts_size =
        (VkDeviceSize)(layers ? layers : request_count) * VKB_COUNTS_SIZE;
    uint32_t request = 0, at = 0;
    const struct vkb_export *output = next_output(requests, request_count, &request, &at);

    readback->counted = output;
    readback->counted_version = 0;
    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind)
        readback->counted = readback->counted || run->inputs[kind].input;
    if (!readback->counted)
        return true;
    for (uint32_t i = 0; i < request_count; ++i)
        if (!check_outputs(run, &requests[i], error))
            return false;
    if (output)
        vkb_export_signal(output, &run->sync.signals[VKB_EXTERNAL_CUDA]);
    if (!vkb_buffer_reserve(run->device, VKB_MEMORY_READBACK, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                            counts_size, &readback->counts, error))
        return false;
    memset(readback->counts.mapped, 0, (size_t)counts_size);
    return vkb_buffer_flush(run->device, &readback->counts, error);
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

static bool copy_output(struct vkb_run *run, struct vkb_image *image,
                        const struct vkb_output *output, struct vkb_error *error)
{
    struct vkb_strided_copy_work work = {
        .kind = run->graph->layers ? VKB_STRIDED_COPY_FROM_LAYERS : VKB_STRIDED_COPY_FROM_IMAGE,
        .layers = run->graph->layers,
        .image = {.imageView = image->view,
                  .imageLayout = vkb_image_layout(image, VKB_ACCESS_DISPATCH_SAMPLED)},
        .layout =
            {
                .width = output->width,
                .height = output->row_count,
                .channels = output->channels,
                .size = (uint32_t)element_size(output->format),
                .layer_stride = (int32_t)output->layer_stride,
            },
        .to = {output->exported->buffer.handle, 0, exported_size(run, output)},
    };

    vkb_image_transition(run->device, run->submission->commands.buffer, image,
                         VKB_ACCESS_DISPATCH_SAMPLED);
    return vkb_bindings_sampler(run->device, &run->frame->pipelines.bindings, image->format, 0,
                                &work.image.sampler, error)
        && copy_strided(run, &work, error);
}

static bool record(struct vkb_run *run, struct vkb_error *error)
{
    const VkCommandBuffer commands = run->submission->commands.buffer;
    const struct vkb_plan *plan = run->request->plan;

    for (uint32_t i = 0; i < plan->output_count; ++i) {
        const struct vkb_output *output = &run->request->outputs[i];
        struct vkb_image *image = &run->images[plan->outputs[i]]->image;
        if (!output->exported)
            continue;
        const VkBuffer buffer = output->exported->buffer.handle;
        if (is_copied(output))
            vkb_readback_copy(run->device, commands, image, output, buffer, 0);
        else if (!copy_output(run, image, output, error))
            return false;
        vkb_barrier_record_owner(run->device, commands, buffer,
                                 is_copied(output) ? VKB_ACCESS_COPY_TARGET
                                                   : VKB_ACCESS_DISPATCH_STORED,
                                 VKB_ACCESS_PRESENTED);
    }
    return true;
}

const struct vkb_sink vkb_cuda_sink = {prepare, record, finish};
