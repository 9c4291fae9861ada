#include "run/resident.h"

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

// A handle may go at any time, in any thread.
static void destroy_images(const struct vkb_device *device, struct vkb_resident *resident)
{
    const struct vkb_messages *before = vkb_messages_begin(&device->messages);

    vkb_image_destroy(device, &resident->cached.image);
    vkb_upload_destroy(device, &resident->upload);
    vkb_messages_end(before);
}

// Nobody asks a closed one for more.
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

    if (!resident)
        return NULL;
    resident->next = residents->first;
    if (resident->next)
        resident->next->previous = resident;
    residents->first = resident;
    return resident;
}

void vkb_resident_release(struct vkb_residents *residents, struct vkb_resident *resident)
{
    if (residents->device)
        destroy_images(residents->device, resident);
    if (resident->previous)
        resident->previous->next = resident->next;
    else
        residents->first = resident->next;
    if (resident->next)
        resident->next->previous = resident->previous;
    vkb_free(resident);
    free_closed(residents);
}

void vkb_resident_use(struct vkb_resident *resident)
{
    ++resident->uses;
}

void vkb_resident_end_use(struct vkb_residents *residents, struct vkb_resident *resident)
{
    --resident->uses;
    if (resident->uses == 0 && !resident->staged && !resident->recycled && residents->device) {
        const struct vkb_messages *before = vkb_messages_begin(&residents->device->messages);
        vkb_upload_destroy(residents->device, &resident->upload);
        vkb_messages_end(before);
    }
}

bool vkb_resident_stage(struct vkb_device *device, struct vkb_resident *resident,
                        const struct vkb_input *input, uint64_t *clock, struct vkb_error *error)
{
    const struct vkb_image_row row = {
        .name = "image",
        .format = input->format,
        .width = input->width,
        .height = input->height,
        .input = true,
    };
    struct vkb_image *image = &resident->cached.image;
    bool changed;

    if (!vkb_check_size(row.name, row.width, row.height, device->max_side, error)
        || !vkb_image_row_check(device, &row, error))
        return false;
    if (!vkb_image_fits(image, &row)) {
        vkb_image_destroy(device, image);
        if (!vkb_image_create_row(device, &row, image, error))
            return false;
    }
    vkb_upload_forget(&resident->upload);
    if (!vkb_upload_stage(device, &resident->upload, NULL, input, image, &changed, error))
        return false;
    resident->specials = resident->upload.specials;
    resident->staged = !image->mapped;
    resident->cached.content.version = ++*clock;
    resident->cached.content.valid = true;
    // What was packed for mapped memory is there; nothing compares it.
    if (image->mapped && !resident->recycled)
        vkb_upload_destroy(device, &resident->upload);
    return true;
}
