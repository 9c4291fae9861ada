#include "transfer/sources.h"

#include "share/exported_images.h"
#include "transfer/readback.h"

void vkb_run_set_image(struct vkb_run *run, uint32_t image, struct vkb_cached_image *cached)
{
    run->images[image] = cached;
    run->contents[image] = cached ? &cached->content : NULL;
}

struct vkb_image_row vkb_run_row(const struct vkb_run *run, uint32_t image)
{
    struct vkb_image_row row = run->graph->images[image];

    row.usage = run->usages[image];
    return row;
}

bool vkb_run_resolve(struct vkb_run *run, uint32_t image, struct vkb_error *error)
{
    const struct vkb_image_row row = vkb_run_row(run, image);
    struct vkb_image_cache *cache = &run->frame->cache;
    struct vkb_cached_image *cached = run->inputs[row.input].image;

    if (!cached)
        cached = vkb_image_cache_find(cache, &row);
    if (!cached
        && ((vkb_image_cache_replaces(cache, &row)
             && !vkb_submissions_wait(run->device, &run->frame->submissions, error))
            || !(cached = vkb_image_cache_add(run->device, cache, &row, error))))
        return false;
    cached->used = cache->now;
    vkb_run_set_image(run, image, cached);
    return true;
}

// An input of the requests that are staged.
struct pixels {
    const struct vkb_frame_source *source;
    const struct vkb_request *requests;
    uint32_t request_count;
    uint32_t image;  // of the graph
    enum vkb_input_kind kind;
};

// Whether the output of that image lies in the memory of the input's rows.
static bool overlaps(const struct vkb_output *output, const struct vkb_image_row *row,
                     const struct vkb_input *input)
{
    const uintptr_t start = (uintptr_t)output->memory, other = (uintptr_t)input->memory;
    const size_t pixel_size = output->channels * vkb_formats[row->format].channel_size;
    const size_t size = (size_t)row->width * output->row_count * pixel_size;

    return output->memory && start < other + (size_t)input->row_stride * input->height
        && other < start + size;
}

// Whether all passes of the request that may read the image read linear texels, and nothing copies
// it to an output or writes to the memory of its pixels.
static bool allows_in_place(const struct vkb_request *request, uint32_t image,
                            const struct vkb_input *input)
{
    const struct vkb_graph *graph = &request->plan->graph;

    for (uint32_t i = 0; i < graph->pass_count; ++i) {
        const struct vkb_pass_row *pass = &graph->passes[i];
        if (vkb_pass_reads(pass, image)
            && (pass->reading != VKB_READING_LINEAR_TEXELS
                || (input->channels != 4
                    && (pass->reads[SLOT_SOURCE] != image || !pass->shader->rgb))))
            return false;
    }
    for (uint32_t i = 0; i < request->plan->output_count; ++i)
        if (request->plan->outputs[i] == image
            || overlaps(&request->outputs[i], &graph->images[request->plan->outputs[i]], input))
            return false;
    return true;
}

static void stage_image_of(struct vkb_run *run, enum vkb_input_kind kind,
                           struct vkb_resident *resident, enum vkb_input_kind of)
{
    struct vkb_staged_input *staged = &run->inputs[kind];

    staged->resident = resident;
    staged->image = &resident->inputs[of].cached;
    staged->upload = &resident->inputs[of].upload;
    staged->send = resident->staged;
    staged->access = staged->image->image.access;
}

static bool stage_resident(struct vkb_run *run, const struct pixels *pixels, bool *taken,
                           struct vkb_error *error)
{
    struct vkb_resident *resident = pixels->source->resident;

    (void)error;
    *taken = resident;
    if (!resident)
        return true;
    stage_image_of(run, pixels->kind, resident, pixels->kind);
    // Those of all its images.
    run->frame->non_finite = resident->non_finite;
    run->unknown_non_finite = run->unknown_non_finite || resident->uncounted;
    return true;
}

// Without an image it is the cached one of the row, with zeros.
static bool stage_history(struct vkb_run *run, const struct pixels *pixels, bool *taken,
                          struct vkb_error *error)
{
    (void)error;
    *taken = pixels->kind >= VKB_INPUT_HISTORY;
    if (!*taken)
        return true;
    struct vkb_resident *resident = pixels->source->histories[pixels->kind - VKB_INPUT_HISTORY];
    if (resident)
        stage_image_of(run, pixels->kind, resident, VKB_INPUT_IMAGE);
    run->unknown_non_finite = run->unknown_non_finite || resident;
    return true;
}

static void end_resident(struct vkb_staged_input *staged, bool submitted)
{
    if (submitted)
        staged->resident->staged = false;
    else
        // The recorded commands do not run, so the image keeps its last access.
        staged->image->image.access = staged->access;
}

static size_t row_size(const struct vkb_input *input)
{
    return (size_t)input->width * input->channels * vkb_formats[input->format].channel_size;
}

// Whether the rows consist of whole words.
static bool has_words(const struct vkb_device *device, const struct vkb_input *input)
{
    const size_t pitch = (size_t)input->row_stride;

    return vkb_input_is_contiguous(input) && input->row_stride > 0 && pitch >= row_size(input)
        && pitch % VKB_WORD_SIZE == 0 && row_size(input) % VKB_WORD_SIZE == 0
        && pitch / VKB_WORD_SIZE * input->height <= device->limits.maxTexelBufferElements;
}

struct counting {
    const struct vkb_input *input;
    struct vkb_non_finite sums[VKB_MAX_PARTS];
};

static void count_part(void *context, uint32_t part, uint32_t first, uint32_t end)
{
    struct counting *counting = context;
    const struct vkb_input *input = counting->input;

    for (uint32_t y = first; y < end; ++y)
        vkb_add_non_finite(&counting->sums[part],
                           vkb_count_non_finite(input->format, vkb_input_row(input, y),
                                                (size_t)input->width * input->channels));
}

// Makes place->cached an image over the input's memory, with a new version. The submission destroys
// the image when the device has read it. False if passes cannot read words of this memory. Also
// false for the array that was read last: it may have the same pixels again, so it is worth a copy,
// with which it is compared from then on.
static bool borrow(const struct vkb_device *device, struct vkb_in_place *place,
                   const struct vkb_input *input, uint64_t *clock)
{
    const size_t size = row_size(input) * input->height;
    struct counting counting = {.input = input};
    struct vkb_image image = {
        .format = input->format,
        .width = input->width,
        .height = input->height,
        .channels = input->channels,
        // Passes only read it.
        .mapped = (void *)(uintptr_t)input->memory,
        .row_pitch = (size_t)input->row_stride,
    };

    if (!device->linear_texels || size < VKB_IMPORTED_BYTES || input->memory == place->memory
        || !has_words(device, input) || !vkb_image_borrow(device, row_size(input), &image))
        return false;
    vkb_in_parts(device->workers, count_part, NULL, &counting, 0, input->height, size);
    place->non_finite = (struct vkb_non_finite){0};
    for (int part = 0; part < VKB_MAX_PARTS; ++part)
        vkb_add_non_finite(&place->non_finite, counting.sums[part]);
    place->memory = input->memory;
    place->cached.image = image;
    place->cached.content.version = ++*clock;
    place->cached.content.valid = true;
    return true;
}

static bool stage_in_place(struct vkb_run *run, const struct pixels *pixels, bool *taken,
                           struct vkb_error *error)
{
    const struct vkb_input *input = pixels->source->inputs[pixels->kind];
    struct vkb_in_place *place = &run->frame->in_place[pixels->kind];

    (void)error;
    if (!pixels->source->in_place || !input)
        return true;
    for (uint32_t i = 0; i < pixels->request_count; ++i)
        if (!allows_in_place(&pixels->requests[i], pixels->image, input))
            return true;
    *taken = borrow(run->device, place, input, &run->frame->cache.clock);
    if (!*taken)
        return true;
    run->inputs[pixels->kind].image = &place->cached;
    run->submission->inputs[pixels->kind] = place->cached.image;
    if (!vkb_is_grey(pixels->kind))
        vkb_add_non_finite(&run->frame->non_finite, place->non_finite);
    return true;
}

static bool stage_exported(struct vkb_run *run, const struct pixels *pixels, bool *taken,
                           struct vkb_error *error)
{
    const struct vkb_input *input = pixels->source->inputs[pixels->kind];
    struct vkb_staged_input *staged = &run->inputs[pixels->kind];

    *taken = input && input->exported;
    if (!*taken)
        return true;
    if (!vkb_exported_check(run->device, input, error)
        || !vkb_run_resolve(run, pixels->image, error))
        return false;
    staged->image = run->images[pixels->image];
    staged->input = input;
    staged->send =
        !vkb_content_holds(&staged->image->content, &input->pixels, sizeof input->pixels);
    // Cotangents may have them.
    run->unknown_non_finite =
        run->unknown_non_finite || (!vkb_is_grey(pixels->kind) && pixels->kind < VKB_INPUT_LEVEL);
    return !staged->send
        || vkb_content_begin_writing(&staged->image->content, &run->frame->cache.clock,
                                     &input->pixels, sizeof input->pixels, error);
}

// Stages the image if the device does not have it yet.
static bool stage_upload(struct vkb_run *run, const struct pixels *pixels, bool *taken,
                         struct vkb_error *error)
{
    struct vkb_upload *upload = &run->frame->uploads[pixels->kind];
    struct vkb_staged_input *staged = &run->inputs[pixels->kind];
    bool changed;

    *taken = true;
    if (!vkb_run_resolve(run, pixels->image, error))
        return false;
    struct vkb_cached_image *image = run->images[pixels->image];
    // What an upload has written has no recipe. Otherwise there is no content to compare with.
    const bool held = vkb_content_holds(&image->content, NULL, 0);
    if (!held)
        vkb_upload_forget(upload);
    if (!vkb_upload_stage(run->device, upload, &run->frame->submissions, run->submission->number,
                          pixels->source->inputs[pixels->kind], &image->image, &changed, error))
        return false;
    staged->image = image;
    staged->upload = upload;
    staged->send = changed;
    if (!vkb_is_grey(pixels->kind))
        vkb_add_non_finite(&run->frame->non_finite, upload->non_finite);
    return !staged->send
        || vkb_content_begin_writing(&image->content, &run->frame->cache.clock, NULL, 0, error);
}

static bool record_copy(struct vkb_run *run, struct vkb_staged_input *staged,
                        struct vkb_error *error)
{
    (void)error;
    if (!staged->send)
        return true;
    if (!staged->image->image.mapped)
        vkb_upload_record(run->device, run->submission->commands.buffer, staged->upload,
                          &staged->image->image);
    staged->image->content.valid = true;
    return true;
}

static const struct vkb_source_way {
    // Sets *taken where the way suits the input.
    bool (*stage)(struct vkb_run *run, const struct pixels *pixels, bool *taken,
                  struct vkb_error *error);
    // Both may be NULL.
    bool (*record)(struct vkb_run *run, struct vkb_staged_input *staged, struct vkb_error *error);
    void (*end)(struct vkb_staged_input *staged, bool submitted);
} ways[] = {
    {stage_history, record_copy, end_resident},
    {stage_resident, record_copy, end_resident},
    {stage_exported, vkb_exported_record_input, NULL},
    {stage_in_place, NULL, NULL},
    {stage_upload, record_copy, NULL},
};

bool vkb_sources_stage(struct vkb_run *run, const struct vkb_frame_source *source,
                       const struct vkb_request *requests, uint32_t request_count,
                       struct vkb_error *error)
{
    struct pixels pixels = {source, requests, request_count, 0, VKB_INPUT_NONE};

    run->frame->non_finite = (struct vkb_non_finite){0};
    for (; pixels.image < run->graph->image_count; ++pixels.image) {
        bool taken = false;
        pixels.kind = run->graph->images[pixels.image].input;
        if (pixels.kind == VKB_INPUT_NONE)
            continue;
        for (size_t i = 0; !taken && i < sizeof ways / sizeof ways[0]; ++i) {
            if (!ways[i].stage(run, &pixels, &taken, error))
                return false;
            run->inputs[pixels.kind].way = &ways[i];
        }
    }
    return true;
}

bool vkb_sources_record(struct vkb_run *run, struct vkb_error *error)
{
    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind)
        if (run->inputs[kind].image && run->inputs[kind].way->record
            && !run->inputs[kind].way->record(run, &run->inputs[kind], error))
            return false;
    return true;
}

void vkb_sources_end(struct vkb_run *run, bool submitted)
{
    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind)
        if (run->inputs[kind].image && run->inputs[kind].way->end)
            run->inputs[kind].way->end(&run->inputs[kind], submitted);
}

uint64_t vkb_sources_version(const struct vkb_run *run)
{
    uint64_t version = 0;

    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind)
        if (run->inputs[kind].image && run->inputs[kind].image->content.version > version)
            version = run->inputs[kind].image->content.version;
    return version ? version : run->frame->scene.serial;
}
