#include "transfer/resident.h"

#include "execute/limits.h"
#include "execute/list.h"

struct vkb_residents {
    const struct vkb_device *device;  // NULL: closed
    struct vkb_resident *first;
};

struct vkb_residents *vkb_residents_create(const struct vkb_device *device, struct vkb_error *error)
{
    struct vkb_residents *residents = vkb_alloc(error, 1, sizeof *residents);

    if (residents)
        residents->device = device;
    return residents;
}

// A handle may be freed at any time, in any thread.
static void destroy_images(const struct vkb_device *device, struct vkb_resident *resident)
{
    const struct vkb_messages *before = vkb_messages_begin(&device->messages);

    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind) {
        vkb_image_destroy(device, &resident->inputs[kind].cached.image);
        vkb_upload_destroy(device, &resident->inputs[kind].upload);
    }
    vkb_messages_end(before);
}

// A closed object is freed with its last image.
static void free_closed(struct vkb_residents *residents)
{
    if (!residents->device && !residents->first)
        vkb_free(residents);
}

void vkb_residents_close(struct vkb_residents *residents)
{
    if (!residents)
        return;
    for (struct vkb_resident *one = residents->first; one; one = one->next)
        destroy_images(residents->device, one);
    residents->device = NULL;
    free_closed(residents);
}

struct vkb_resident *vkb_resident_add(struct vkb_residents *residents, struct vkb_error *error)
{
    struct vkb_resident *resident = vkb_alloc(error, 1, sizeof *resident);

    if (resident)
        VKB_PUSH(&residents->first, resident);
    return resident;
}

void vkb_resident_release(struct vkb_residents *residents, struct vkb_resident *resident)
{
    if (residents->device)
        destroy_images(residents->device, resident);
    VKB_UNLINK(&residents->first, resident);
    vkb_free(resident);
    free_closed(residents);
}

void vkb_resident_end_use(struct vkb_residents *residents, struct vkb_resident *resident)
{
    --resident->uses;
    if (resident->uses == 0 && !resident->staged && !resident->recycled && residents->device) {
        const struct vkb_messages *before = vkb_messages_begin(&residents->device->messages);
        for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind)
            vkb_upload_destroy(residents->device, &resident->inputs[kind].upload);
        vkb_messages_end(before);
    }
}

void vkb_resident_take(struct vkb_resident *resident, struct vkb_cached_image *from)
{
    struct vkb_cached_image *to = &resident->inputs[VKB_INPUT_IMAGE].cached;

    to->image = from->image;
    to->content.version = from->content.version;
    to->content.valid = true;
    resident->uncounted = true;
    from->image = (struct vkb_image){0};
    from->content.valid = false;
}

bool vkb_resident_fill(struct vkb_device *device, struct vkb_resident *resident,
                       enum vkb_input_kind kind, const struct vkb_input *input, uint64_t *clock,
                       struct vkb_error *error)
{
    const struct vkb_image_row row = {
        .name = "image",
        .format = input->format,
        .width = input->width,
        .height = input->height,
        .input = kind,
        // Whatever plan it will be for.
        .usage = vkb_access_usage(VKB_ACCESS_COPY_SOURCE) | vkb_access_usage(VKB_ACCESS_SAMPLED)
               | (device->linear_texels ? 0 : vkb_access_usage(VKB_ACCESS_COPY_TARGET))
               | (device->dispatch ? vkb_access_usage(VKB_ACCESS_DISPATCH_LOADED) : 0),
    };
    struct vkb_cached_image *cached = &resident->inputs[kind].cached;
    bool changed;

    if (!vkb_check_size(row.name, row.width, row.height, device->max_side, error)
        || !vkb_limits_check_image(device, &row, error))
        return false;
    if (!vkb_image_fits(&cached->image, &row)) {
        vkb_image_destroy(device, &cached->image);
        if (!vkb_image_create_row(device, &row, NULL, &cached->image, error))
            return false;
    }
    if (!vkb_upload_stage(device, &resident->inputs[kind].upload, NULL, 0, input, &cached->image,
                          &changed, error))
        return false;
    resident->staged = !cached->image.mapped;
    cached->content.version = ++*clock;
    cached->content.valid = true;
    resident->non_finite = (struct vkb_non_finite){0};
    for (int i = 0; i < VKB_INPUT_COUNT; ++i)
        if (!vkb_is_grey((enum vkb_input_kind)i))
            vkb_add_non_finite(&resident->non_finite, resident->inputs[i].upload.non_finite);
    return true;
}
