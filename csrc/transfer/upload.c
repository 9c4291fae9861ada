#include "transfer/upload.h"

#include "vulkan/parts.h"

#include <string.h>
#if defined __x86_64__
#include <tmmintrin.h>
#endif

enum {
    // The device copies rows while the host packs others. The first copy has at least so many
    // bytes. Each copy is a submission, which takes about 10 us; the transfer of 1 MiB takes 20 us.
    FIRST_BAND_SIZE = 1 << 20,
    // Each copy has at least as many bytes as all before it, up to this limit: the last copy is not
    // hidden. Without such copies `Separable` takes 8.8 ms in place of 6.8 from array to array
    // (3840 x 2160, RGBA in float32, H200, 2026-11-27); with equal copies of a MiB it takes 1.02 in
    // place of 0.97 (1920 x 1080, float16, 2026-11-29).
    BAND_SIZE = 4 << 20,
};

void vkb_upload_destroy(const struct vkb_device *device, struct vkb_upload *upload)
{
    vkb_buffer_destroy(device, &upload->staging);
    vkb_free(upload->rows);
    vkb_free(upload->packed);
    *upload = (struct vkb_upload){0};
}

// A channel of 1 in each format, as bytes.
static const void *channel_one(enum vkb_format format)
{
    static const uint8_t byte = 255;
    static const uint16_t half = 0x3c00;
    static const float single = 1.0f;

    return format == VKB_FORMAT_RGBA8_UNORM  ? (const void *)&byte
         : format == VKB_FORMAT_RGBA16_FLOAT ? (const void *)&half
                                             : (const void *)&single;
}

// The next two functions are compiled once for each channel size, so that no memcpy has a variable
// size.

// Packs a row of RGB pixels without gaps.
static inline void pack_rgb(unsigned char *to, const unsigned char *from, uint32_t width,
                            const void *one, size_t size)
{
    for (uint32_t x = 1; x < width; ++x, to += 4 * size, from += 3 * size) {
        // One move for each pixel: it also copies the next pixel's red, which is then overwritten.
        memcpy(to, from, 4 * size);
        memcpy(to + 3 * size, one, size);
    }
    memcpy(to, from, 3 * size);
    memcpy(to + 3 * size, one, size);
}

#if defined __x86_64__
// The same for bytes, four pixels at a time. Without it a picture of 1920 x 1080 is packed in 0.54
// ms in place of 0.18 (one core of an EPYC, 2026-11-29).
__attribute__((target("ssse3"))) static void
pack_rgb_bytes(unsigned char *to, const unsigned char *from, uint32_t width, const void *one)
{
    const __m128i places = _mm_setr_epi8(0, 1, 2, -1, 3, 4, 5, -1, 6, 7, 8, -1, 9, 10, 11, -1);
    const __m128i opaque = _mm_set1_epi32((int32_t)UINT32_C(0xff000000));

    // A load has bytes of the next two pixels, too.
    for (; width >= 6; width -= 4, to += 16, from += 12) {
        const __m128i pixels = _mm_loadu_si128((const __m128i_u *)from);
        _mm_storeu_si128((__m128i_u *)to, _mm_or_si128(_mm_shuffle_epi8(pixels, places), opaque));
    }
    pack_rgb(to, from, width, one, 1);
}
#endif

static void pack_bytes(unsigned char *to, const unsigned char *from, uint32_t width,
                       const void *one)
{
#if defined __x86_64__
    if (__builtin_cpu_supports("ssse3")) {
        pack_rgb_bytes(to, from, width, one);
        return;
    }
#endif
    pack_rgb(to, from, width, one, 1);
}

static inline void pack_strided(unsigned char *to, const unsigned char *from,
                                const struct vkb_input *input, const void *one, size_t size)
{
    const size_t pixel_size = vkb_pixel_size(input->format);

    for (uint32_t x = 0; x < input->width; ++x, to += pixel_size, from += input->pixel_stride) {
        for (uint32_t channel = 0; channel < input->channels; ++channel)
            memcpy(to + channel * size, from + channel * input->channel_stride, size);
        if (input->channels == 3)
            memcpy(to + 3 * size, one, size);
    }
}

// Whether the input has all channels of its format; an RGB image has not.
static bool is_complete(const struct vkb_input *input)
{
    return input->channels == vkb_formats[input->format].channels;
}

bool vkb_input_is_contiguous(const struct vkb_input *input)
{
    const ptrdiff_t size = vkb_formats[input->format].channel_size;

    return input->channel_stride == size && input->pixel_stride == input->channels * size;
}

static size_t row_size(const struct vkb_input *input)
{
    return (size_t)input->width * vkb_pixel_size(input->format);
}

static void pack_row(unsigned char *to, const struct vkb_input *input, uint32_t y)
{
    const unsigned char *from = vkb_input_row(input, y);
    const void *one = channel_one(input->format);
    const bool contiguous = vkb_input_is_contiguous(input);

    if (contiguous && is_complete(input)) {
        memcpy(to, from, row_size(input));
        return;
    }
    switch (vkb_formats[input->format].channel_size) {
    case 1:
        contiguous ? pack_bytes(to, from, input->width, one)
                   : pack_strided(to, from, input, one, 1);
        break;
    case 2:
        contiguous ? pack_rgb(to, from, input->width, one, 2)
                   : pack_strided(to, from, input, one, 2);
        break;
    default:
        contiguous ? pack_rgb(to, from, input->width, one, 4)
                   : pack_strided(to, from, input, one, 4);
        break;
    }
}

static unsigned char *kept_row(const struct vkb_upload *upload, uint32_t y)
{
    return upload->pixels + y * upload->row_pitch;
}

struct rows {
    struct vkb_upload *upload;
    const struct vkb_input *input;
    uint32_t different[VKB_MAX_PARTS];  // the first such row of each part; the height: none
};

// A row of the input as it is kept: the input's own, or packed into the part's row.
static const unsigned char *packed_row(const struct rows *rows, uint32_t part, uint32_t y)
{
    const struct vkb_input *input = rows->input;
    const unsigned char *own = vkb_input_row(input, y);
    unsigned char *packed = rows->upload->packed + part * row_size(input);

    if (is_complete(input) && vkb_input_is_contiguous(input)
        && (uintptr_t)own % vkb_formats[input->format].channel_size == 0)
        return own;
    pack_row(packed, input, y);
    return packed;
}

static bool row_differs(const struct rows *rows, uint32_t part, uint32_t y)
{
    return memcmp(kept_row(rows->upload, y), packed_row(rows, part, y), row_size(rows->input)) != 0;
}

static void compare_part(void *context, uint32_t part, uint32_t first, uint32_t end)
{
    struct rows *rows = context;

    // Rows come in their order: this one would not be the first that differs.
    if (rows->different[part] < first)
        return;
    while (first < end && !row_differs(rows, part, first))
        ++first;
    if (first < end)
        rows->different[part] = first;
}

// The first row in which the input differs from the image that is held; its height: none.
static uint32_t first_difference(const struct vkb_device *device, struct vkb_upload *upload,
                                 const struct vkb_input *input)
{
    struct rows rows = {.upload = upload, .input = input};
    uint32_t first = input->height;

    // Another image usually differs in its first row, without work for several threads.
    if (row_differs(&rows, 0, 0))
        return 0;
    for (int part = 0; part < VKB_MAX_PARTS; ++part)
        rows.different[part] = first;
    vkb_in_parts(device->workers, compare_part, NULL, &rows, 1, input->height,
                 input->height * row_size(input));
    for (int part = 0; part < VKB_MAX_PARTS; ++part)
        first = rows.different[part] < first ? rows.different[part] : first;
    return first;
}

void vkb_upload_forget(struct vkb_upload *upload)
{
    upload->format = VKB_FORMAT_NONE;
}

static bool holds_such(const struct vkb_upload *upload, const struct vkb_input *input)
{
    return upload->format == input->format && upload->width == input->width
        && upload->height == input->height && upload->channels == input->channels;
}

// Reserves memory for an image of another size or format than the last.
static bool begin(const struct vkb_device *device, struct vkb_upload *upload,
                  const struct vkb_input *input, const struct vkb_image *image,
                  struct vkb_error *error)
{
    const size_t size = row_size(input);

    vkb_upload_forget(upload);
    if (!vkb_grow(error, &upload->rows, &upload->row_capacity, input->height, sizeof *upload->rows)
        || !vkb_grow(error, &upload->packed, &upload->packed_capacity, VKB_MAX_PARTS * size, 1))
        return false;
    // Cached host memory, since the host reads it to compare it with the next image.
    if (!image->mapped
        && !vkb_buffer_reserve(device, VKB_MEMORY_READBACK, VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                               size * input->height, &upload->staging, error))
        return false;
    memset(upload->rows, 0, input->height * sizeof *upload->rows);
    upload->non_finite = (struct vkb_non_finite){0};
    upload->pixels = image->mapped ? image->mapped : upload->staging.mapped;
    upload->row_pitch = image->mapped ? image->row_pitch : size;
    upload->format = input->format;
    upload->sent = 0;
    upload->width = input->width;
    upload->height = input->height;
    upload->channels = input->channels;
    return true;
}

static void count_row(struct vkb_upload *upload, uint32_t y, const void *row)
{
    upload->rows[y] = vkb_count_non_finite(
        upload->format, row, (size_t)upload->width * vkb_formats[upload->format].channels);
}

static void pack_part(void *context, uint32_t part, uint32_t first, uint32_t end)
{
    const struct rows *rows = context;
    struct vkb_upload *upload = rows->upload;

    (void)part;
    for (uint32_t y = first; y < end; ++y) {
        unsigned char *to = kept_row(upload, y);
        pack_row(to, rows->input, y);
        count_row(upload, y, to);
    }
}

// Copies past the host's caches to memory that a device reads over a bus: from caches of many cores
// it reads more slowly. Another array of 1920 x 1080 in float16 takes 1.02 ms in place of 1.20 (16
// cores, H200, 2026-11-29).
static void stream(unsigned char *to, const unsigned char *from, size_t size)
{
#if defined __x86_64__
    const size_t head = -(uintptr_t)to % sizeof(__m128i);

    if (size >= head + sizeof(__m128i)) {
        memcpy(to, from, head);
        to += head;
        from += head;
        size -= head;
        for (; size >= sizeof(__m128i);
             to += sizeof(__m128i), from += sizeof(__m128i), size -= sizeof(__m128i))
            _mm_stream_si128((__m128i *)(void *)to, _mm_loadu_si128((const __m128i_u *)from));
    }
#endif
    memcpy(to, from, size);
}

static void end_streaming(void)
{
#if defined __x86_64__
    _mm_sfence();
#endif
}

// As pack_part, to memory from which the device copies.
static void stream_part(void *context, uint32_t part, uint32_t first, uint32_t end)
{
    const struct rows *rows = context;
    struct vkb_upload *upload = rows->upload;

    for (uint32_t y = first; y < end; ++y) {
        const unsigned char *row = packed_row(rows, part, y);
        count_row(upload, y, row);
        stream(kept_row(upload, y), row, row_size(rows->input));
    }
    end_streaming();
}

static void sum_non_finite(struct vkb_upload *upload)
{
    upload->non_finite = (struct vkb_non_finite){0};
    for (uint32_t y = 0; y < upload->height; ++y)
        vkb_add_non_finite(&upload->non_finite, upload->rows[y]);
}

static void record_rows(const struct vkb_device *device, VkCommandBuffer commands,
                        const struct vkb_upload *upload, const struct vkb_image *image,
                        uint32_t first, uint32_t end)
{
    const VkBufferImageCopy copy = {
        .bufferOffset = first * upload->row_pitch,
        .imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1},
        .imageOffset = {0, (int32_t)first, 0},
        .imageExtent = {image->width, end - first, 1},
    };

    device->vk.vkCmdCopyBufferToImage(commands, upload->staging.handle, image->handle,
                                      vkb_access_layout(VKB_ACCESS_COPY_TARGET), 1, &copy);
}

// Rows that are packed while the device copies those before them.
struct sending {
    struct rows rows;  // the first member, as which pack_part gets it
    struct vkb_device *device;
    struct vkb_submissions *submissions;
    uint64_t number;
    struct vkb_image *image;
    bool failed;
    struct vkb_error *error;
};

// Submits the copy of the rows from `sent` to `end`. The rows are disjoint, so that only the first
// copy needs a barrier.
static bool send_rows(const struct sending *sending, uint32_t end)
{
    struct vkb_device *device = sending->device;
    struct vkb_upload *upload = sending->rows.upload;
    struct vkb_submission *submission;

    if (!vkb_submissions_take(device, sending->submissions, &submission, sending->error))
        return false;
    submission->number = sending->number;
    bool done = vkb_commands_begin(device, &submission->commands, sending->error)
             && vkb_buffer_flush(device, &upload->staging, sending->error);
    if (done && sending->image->access != VKB_ACCESS_COPY_TARGET)
        vkb_image_transition(device, submission->commands.buffer, sending->image,
                             VKB_ACCESS_COPY_TARGET);
    if (done) {
        record_rows(device, submission->commands.buffer, upload, sending->image, upload->sent, end);
        done = vkb_submission_submit(device, submission, NULL, sending->error);
    }
    if (!done)
        vkb_commands_destroy(device, &submission->commands);
    vkb_submissions_give_back(device, sending->submissions, submission);
    upload->sent = end;
    return done;
}

// The last rows are left to the submission that uses the image.
static void send_done(void *context, uint32_t end)
{
    struct sending *sending = context;
    const struct vkb_upload *upload = sending->rows.upload;
    const size_t sent = upload->sent * upload->row_pitch;
    const size_t most = sent < BAND_SIZE ? sent : BAND_SIZE;
    const size_t least = most > FIRST_BAND_SIZE ? most : FIRST_BAND_SIZE;

    if (!sending->failed && end < upload->height && end * upload->row_pitch - sent >= least)
        sending->failed = !send_rows(sending, end);
}

bool vkb_upload_stage(struct vkb_device *device, struct vkb_upload *upload,
                      struct vkb_submissions *submissions, uint64_t number,
                      const struct vkb_input *input, struct vkb_image *image, bool *changed,
                      struct vkb_error *error)
{
    const bool fresh = !submissions || !holds_such(upload, input);
    const uint32_t first = fresh ? 0 : first_difference(device, upload, input);
    const size_t size = (input->height - first) * row_size(input);
    struct sending sending = {
        .rows = {.upload = upload, .input = input},
        .device = device,
        .submissions = submissions,
        .number = number,
        .image = image,
        .error = error,
    };

    upload->sent = 0;
    *changed = first < input->height;
    if (!*changed)
        return true;
    if ((submissions && !vkb_submissions_wait(device, submissions, error))
        || (fresh && !begin(device, upload, input, image, error)))
        return false;
    // A small image is compared with the next one soon.
    vkb_in_parts(device->workers, image->mapped || size < FIRST_BAND_SIZE ? pack_part : stream_part,
                 image->mapped || !submissions ? NULL : send_done, &sending, first, input->height,
                 size);
    sum_non_finite(upload);
    return !sending.failed && (image->mapped || vkb_buffer_flush(device, &upload->staging, error));
}

void vkb_upload_record(const struct vkb_device *device, VkCommandBuffer commands,
                       struct vkb_upload *upload, struct vkb_image *image)
{
    vkb_image_transition(device, commands, image, VKB_ACCESS_COPY_TARGET);
    record_rows(device, commands, upload, image, upload->sent, upload->height);
    upload->sent = 0;
}
