#include "execute/image_cache.h"

#include "vulkan/labels.h"

#include <string.h>

void vkb_image_cache_destroy(const struct vkb_device *device, struct vkb_image_cache *cache)
{
    for (size_t i = 0; i < cache->count; ++i) {
        struct vkb_cached_image *cached = cache->images[i];
        vkb_image_destroy(device, &cached->image);
        vkb_free(cached->content.recipe);
        vkb_free(cached);
    }
    vkb_free(cache->images);
    vkb_spares_free(device, &cache->spares);
    // The clock continues, so that versions stay unique.
    *cache = (struct vkb_image_cache){
        .clock = cache->clock, .now = cache->now, .spares.missed = cache->spares.missed};
}

// Destroys the image and keeps its entry, since there are only a few names.
static void destroy_image(const struct vkb_device *device, struct vkb_cached_image *cached)
{
    cached->content.valid = false;
    vkb_image_destroy(device, &cached->image);
}

static uint64_t image_size(const struct vkb_image *image)
{
    return image->handle ? (uint64_t)image->width * image->height * image->layers
                               * vkb_pixel_size(image->format)
                         : 0;
}

uint64_t vkb_image_cache_size(const struct vkb_image_cache *cache)
{
    uint64_t size = cache->spares.size;

    for (size_t i = 0; i < cache->count; ++i)
        size += image_size(&cache->images[i]->image);
    return size;
}

// Spare memory takes at most as much as the images of the last submissions did together.
static void trim_spares(const struct vkb_device *device, struct vkb_image_cache *cache,
                        const struct vkb_age *age)
{
    struct vkb_spare *oldest;
    uint64_t images = 0;

    // Of their memory, which may be larger than their pixels.
    for (size_t i = 0; i < cache->count; ++i)
        images += cache->images[i]->image.memory_size;
    if (images >= cache->peak || cache->peaked + VKB_MIN_AGE < age->now) {
        cache->peak = images;
        cache->peaked = age->now;
    }
    while (cache->spares.size > cache->peak && (oldest = vkb_spares_oldest(&cache->spares))
           && oldest->used < age->pending)
        vkb_spares_free_one(device, &cache->spares, oldest);
}

static struct vkb_cached_image *find_oldest(const struct vkb_image_cache *cache)
{
    struct vkb_cached_image *oldest = NULL;

    for (size_t i = 0; i < cache->count; ++i)
        if (cache->images[i]->image.handle && (!oldest || cache->images[i]->used < oldest->used))
            oldest = cache->images[i];
    return oldest;
}

void vkb_image_cache_trim(const struct vkb_device *device, struct vkb_image_cache *cache,
                          const struct vkb_age *age)
{
    trim_spares(device, cache, age);
    uint64_t size = vkb_image_cache_size(cache);
    const uint64_t left = size > VKB_KEPT_IMAGE_BYTES ? VKB_KEPT_IMAGE_BYTES / 2 : size;

    cache->now = age->now;
    while (size > left) {
        struct vkb_spare *spare = vkb_spares_oldest(&cache->spares);
        struct vkb_cached_image *image = find_oldest(cache);
        if (spare && image && spare->used <= image->used)
            image = NULL;
        if ((!image && !spare) || !vkb_is_old(image ? image->used : spare->used, age))
            return;
        size -= image ? image_size(&image->image) : spare->size;
        if (image)
            destroy_image(device, image);
        else
            vkb_spares_free_one(device, &cache->spares, spare);
    }
}

bool vkb_image_create_row(const struct vkb_device *device, const struct vkb_image_row *row,
                          struct vkb_spares *spares, struct vkb_image *image,
                          struct vkb_error *error)
{
    return vkb_image_create(
        device,
        &(struct vkb_image_spec){
            .format = row->format,
            .width = row->width,
            .height = row->height,
            .layers = row->layers,
            .array = row->layers > 0,
            .usage = row->usage,
            .mapped = device->linear_texels && row->format != VKB_FORMAT_DEPTH32_FLOAT,
            .hosted = !vkb_is_given(row),
            .spares = spares,
        },
        image, error);
}

static struct vkb_cached_image *find_cached(const struct vkb_image_cache *cache,
                                            const struct vkb_image_row *row)
{
    for (size_t i = 0; i < cache->count; ++i)
        if (cache->images[i]->array == (row->layers > 0)
            && strcmp(cache->images[i]->name, row->name) == 0)
            return cache->images[i];
    return NULL;
}

static struct vkb_cached_image *add_cached(struct vkb_image_cache *cache,
                                           const struct vkb_image_row *row, struct vkb_error *error)
{
    struct vkb_cached_image *cached =
        vkb_append(error, &cache->images, &cache->count, &cache->capacity, sizeof *cached);

    if (cached) {
        memcpy(cached->name, row->name, sizeof cached->name);
        cached->array = row->layers > 0;
    }
    return cached;
}

static bool is_alike(const struct vkb_image *image, const struct vkb_image_row *row)
{
    return image->handle && image->format == row->format && image->width == row->width
        && image->height == row->height && image->layers == (row->layers ? row->layers : 1)
        && image->array == (row->layers > 0);
}

bool vkb_image_fits(const struct vkb_image *image, const struct vkb_image_row *row)
{
    return is_alike(image, row) && (row->usage & ~image->usage) == 0;
}

struct vkb_cached_image *vkb_image_cache_find(const struct vkb_image_cache *cache,
                                              const struct vkb_image_row *row)
{
    struct vkb_cached_image *cached = find_cached(cache, row);

    return cached && vkb_image_fits(&cached->image, row) ? cached : NULL;
}

// For debuggers, to which names need not be different.
static void label(const struct vkb_device *device, const struct vkb_cached_image *cached)
{
    const char *name = cached->name + (cached->name[0] == VKB_INTERNAL_NAME);

    vkb_label_object(device, VK_OBJECT_TYPE_IMAGE, (uint64_t)cached->image.handle, name);
    if (cached->image.buffer)
        vkb_label_object(device, VK_OBJECT_TYPE_BUFFER, (uint64_t)cached->image.buffer, name);
}

struct vkb_cached_image *vkb_image_cache_entry(const struct vkb_device *device,
                                               struct vkb_image_cache *cache,
                                               const struct vkb_image_row *row,
                                               struct vkb_error *error)
{
    struct vkb_cached_image *cached = find_cached(cache, row);

    if (!cached)
        return add_cached(cache, row, error);
    if (!vkb_image_fits(&cached->image, row))
        destroy_image(device, cached);
    return cached;
}

void vkb_image_cache_move(const struct vkb_device *device, struct vkb_cached_image *from,
                          struct vkb_cached_image *to)
{
    to->image = from->image;
    from->image = (struct vkb_image){0};
    from->content.valid = false;
    label(device, to);
}

bool vkb_image_cache_replaces(const struct vkb_image_cache *cache, const struct vkb_image_row *row)
{
    const struct vkb_cached_image *cached = find_cached(cache, row);

    return cached && cached->image.handle;
}

struct vkb_cached_image *vkb_image_cache_add(const struct vkb_device *device,
                                             struct vkb_image_cache *cache,
                                             const struct vkb_image_row *row,
                                             struct vkb_error *error)
{
    struct vkb_cached_image *cached = find_cached(cache, row);
    struct vkb_image_row both = *row;

    if (!cached && !(cached = add_cached(cache, row, error)))
        return NULL;
    // Also for the plans that it has been for: they may come by turns.
    both.usage |= is_alike(&cached->image, row) ? cached->image.usage : 0;
    cached->content.valid = false;
    vkb_image_spare(device, &cached->image, cached->used, &cache->spares);
    if (!vkb_image_create_row(device, &both, &cache->spares, &cached->image, error))
        return NULL;
    label(device, cached);
    cached->used = cache->now;
    return cached;
}
