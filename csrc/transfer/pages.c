#include "transfer/pages.h"

#include "execute/list.h"

// The most idle memory that is kept, the latest first: a little more than three 4K images of half
// floats.
#define KEPT_BYTES ((size_t)256 << 20)

struct vkb_pages {
    const struct vkb_device *device;    // NULL: closed
    struct vkb_page_run *taken, *idle;  // the latest first
    size_t idle_size;
};

struct vkb_pages *vkb_pages_create(const struct vkb_device *device, struct vkb_error *error)
{
    struct vkb_pages *pages = vkb_alloc(error, 1, sizeof *pages);

    if (pages)
        pages->device = device;
    return pages;
}

static struct vkb_page_run *create_run(const struct vkb_device *device, size_t size,
                                       struct vkb_error *error)
{
    struct vkb_page_run *run = vkb_alloc(error, 1, sizeof *run);

    if (!run)
        return NULL;
    if (!(run->memory = vkb_alloc_pages(device, size, &run->start, error))) {
        vkb_free(run);
        return NULL;
    }
    run->size = vkb_size_of_pages(device, size);
    return run;
}

static void destroy_run(const struct vkb_device *device, struct vkb_page_run *run)
{
    // An array may be freed at any time, in any thread.
    if (device) {
        const struct vkb_messages *before = vkb_messages_begin(&device->messages);
        vkb_buffer_destroy(device, &run->buffer);
        vkb_messages_end(before);
    }
    vkb_free(run->start);
    vkb_free(run);
}

// A run that is up to an eighth too large fits, so that sizes that vary a little share runs.
static struct vkb_page_run *find_idle(const struct vkb_pages *pages, size_t size)
{
    struct vkb_page_run *found = NULL;

    for (struct vkb_page_run *run = pages->idle; run; run = run->next)
        if (run->size >= size && run->size - size <= size / 8 + VKB_SMALL_PAGE
            && (!found || run->size < found->size))
            found = run;
    return found;
}

struct vkb_page_run *vkb_pages_take(struct vkb_pages *pages, size_t size, struct vkb_error *error)
{
    struct vkb_page_run *run = find_idle(pages, size);

    if (run) {
        VKB_UNLINK(&pages->idle, run);
        pages->idle_size -= run->size;
    } else if (!(run = create_run(pages->device, size, error))) {
        return NULL;
    }
    VKB_PUSH(&pages->taken, run);
    return run;
}

static void drop_oldest(struct vkb_pages *pages)
{
    struct vkb_page_run *oldest = pages->idle;

    while (oldest->next)
        oldest = oldest->next;
    VKB_UNLINK(&pages->idle, oldest);
    pages->idle_size -= oldest->size;
    destroy_run(pages->device, oldest);
}

// A closed object is freed with its last run.
static void free_closed(struct vkb_pages *pages)
{
    if (!pages->device && !pages->taken)
        vkb_free(pages);
}

void vkb_pages_give_back(struct vkb_pages *pages, struct vkb_page_run *run)
{
    VKB_UNLINK(&pages->taken, run);
    if (!pages->device) {
        destroy_run(NULL, run);
        free_closed(pages);
        return;
    }
    VKB_PUSH(&pages->idle, run);
    pages->idle_size += run->size;
    while (pages->idle_size > KEPT_BYTES)
        drop_oldest(pages);
}

struct vkb_page_run *vkb_pages_find(const struct vkb_pages *pages, const void *memory)
{
    struct vkb_page_run *run = pages->taken;

    while (run && (uintptr_t)memory - (uintptr_t)run->memory >= run->size)
        run = run->next;
    return run;
}

void vkb_pages_close(struct vkb_pages *pages)
{
    if (!pages)
        return;
    while (pages->idle)
        drop_oldest(pages);
    for (struct vkb_page_run *run = pages->taken; run; run = run->next)
        vkb_buffer_destroy(pages->device, &run->buffer);
    pages->device = NULL;
    free_closed(pages);
}
