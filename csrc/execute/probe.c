#include "execute/probe.h"

#include "share/strided_copy.h"

#include <math.h>
#include <string.h>

enum { TEXELS = 64, VALUES = 4 * TEXELS };

// Records that the texels of the staged values are fetched to the buffer of counts, behind which
// nobody reads the counts.
static bool record(struct vkb_run *run, struct vkb_image *image, struct vkb_error *error)
{
    const struct vkb_device *device = run->device;
    const VkCommandBuffer commands = run->submission->commands.buffer;
    const VkBuffer fetched = run->submission->readback.counts.handle;
    struct vkb_frame *frame = run->frame;
    const VkDeviceSize size = VALUES * sizeof(float);
    struct vkb_strided_copy_work work = {
        .kind = VKB_FETCH_TEXELS,
        .layout = {.width = TEXELS, .height = 1, .channels = 4, .size = sizeof(float)},
        .to = {fetched, 0, size},
        .counts = {fetched, size, VKB_COUNTS_SIZE},
        .image = {.imageView = image->view,
                  .imageLayout = vkb_image_layout(image, VKB_ACCESS_DISPATCH_SAMPLED)},
    };

    vkb_image_fill(device, commands, image, frame->constants.handle, 0);
    vkb_image_transition(device, commands, image, VKB_ACCESS_DISPATCH_SAMPLED);
    if (!vkb_bindings_sampler(device, &frame->pipelines.bindings, image->format, 0,
                              &work.image.sampler, error)
        || !vkb_strided_copy_create(device, frame->pipelines.cache, work.kind,
                                    &frame->strided_copies, error)
        || !vkb_strided_copy_record(device, &frame->strided_copies, commands,
                                    &run->submission->descriptors, &work, error))
        return false;
    vkb_barrier_record(device, commands, NULL, true, VKB_ACCESS_DISPATCH_STORED,
                       VKB_ACCESS_HOST_READ);
    return true;
}

// Fetches the texels whose channels are these values, of the format's size.
static bool fetch(struct vkb_run *run, enum vkb_format format, const void *values, float *fetched,
                  struct vkb_error *error)
{
    struct vkb_device *device = run->device;
    struct vkb_submission *submission = run->submission;
    struct vkb_buffer *given = &run->frame->constants, *counts = &submission->readback.counts;
    const size_t size = TEXELS * vkb_pixel_size(format);
    const struct vkb_image_row row = {
        .name = ".probed_texels",
        .format = format,
        .width = TEXELS,
        .height = 1,
        .usage = vkb_access_usage(VKB_ACCESS_COPY_TARGET)
               | vkb_access_usage(VKB_ACCESS_DISPATCH_SAMPLED),
    };
    // In the cache, since the device may still use what an interrupted wait was for.
    struct vkb_cached_image *cached = NULL;
    bool done = vkb_submissions_wait(device, &run->frame->submissions, error)
             && vkb_buffer_reserve(device, VKB_MEMORY_UPLOAD, VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                                   size, given, error)
             && vkb_buffer_reserve(device, VKB_MEMORY_READBACK, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                                   VALUES * sizeof(float) + VKB_COUNTS_SIZE, counts, error)
             && (cached = vkb_image_cache_add(device, &run->frame->cache, &row, error));

    if (done)
        memcpy(given->mapped, values, size);
    done = done && vkb_buffer_flush(device, given, error)
        && vkb_commands_begin(device, &submission->commands, error)
        && record(run, &cached->image, error)
        && vkb_submission_submit(device, submission, NULL, error)
        && vkb_submission_wait(device, &run->frame->submissions, submission, error)
        && vkb_buffer_invalidate(device, counts, error);
    if (done)
        memcpy(fetched, counts->mapped, VALUES * sizeof *fetched);
    return done;
}

static bool probe(struct vkb_run *run, struct vkb_error *error)
{
    uint8_t levels[VALUES];
    uint16_t halves[VALUES];
    float of_levels[VALUES], of_halves[VALUES];
    bool divided = true, scaled = true, exact = true;

    for (int i = 0; i < VALUES; ++i) {
        levels[i] = (uint8_t)i;
        halves[i] = (uint16_t)(4 * i + 1);  // all are subnormal
    }
    if (!fetch(run, VKB_FORMAT_RGBA8_UNORM, levels, of_levels, error)
        || !fetch(run, VKB_FORMAT_RGBA16_FLOAT, halves, of_halves, error))
        return false;
    for (int i = 0; i < VALUES; ++i) {
        divided = divided && of_levels[i] == (float)i / 255.0f;
        scaled = scaled && of_levels[i] == (float)i * (1.0f / 255.0f);
        exact = exact && of_halves[i] == ldexpf((float)halves[i], -24);
    }
    run->device->texels = !exact  ? VKB_TEXELS_OTHER
                        : divided ? VKB_TEXELS_DIVIDED
                        : scaled  ? VKB_TEXELS_SCALED
                                  : VKB_TEXELS_OTHER;
    return true;
}

static bool is_output(const struct vkb_plan *plan, uint32_t image)
{
    for (uint32_t i = 0; i < plan->output_count; ++i)
        if (plan->outputs[i] == image)
            return true;
    return false;
}

// Whether a fused pass may run, which keeps what an image of such a format would hold: it saves an
// image that the pass before it reads, and that is not requested.
static bool may_keep_texels(const struct vkb_plan *plan)
{
    const struct vkb_graph *graph = &plan->graph;

    for (uint32_t i = 1; i < graph->pass_count; ++i) {
        const int32_t format = (int32_t)graph->passes[i].constants.format;
        const struct vkb_pass_row *replaced = &graph->passes[i - 1];
        if (!graph->passes[i].fused || (format != STORED_UNORM8 && format != STORED_HALF))
            continue;
        for (uint32_t read = 0; read < replaced->read_count; ++read)
            if (replaced->reads[read] != VKB_NO_IMAGE
                && !vkb_is_given(&graph->images[replaced->reads[read]])
                && !is_output(plan, replaced->reads[read]))
                return true;
    }
    return false;
}

bool vkb_probe_texels(struct vkb_run *run, const struct vkb_request *requests,
                      uint32_t request_count, struct vkb_error *error)
{
    bool wanted = false;

    if (run->device->texels != VKB_TEXELS_UNKNOWN)
        return true;
    for (uint32_t i = 0; i < request_count; ++i)
        wanted = wanted || may_keep_texels(requests[i].plan);
    return !wanted || probe(run, error);
}
