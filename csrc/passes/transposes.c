#include "passes/transposes.h"

#include "passes/taps.h"

#include <string.h>

// Floats count up to this number.
enum { MAX_TEXELS = 1 << 24 };
// Of the transposes that are kept. All presets at 3840 x 2160 have less than half of it.
static const size_t MAX_KEPT_BYTES = (size_t)32 << 20;

enum {
    AXIS_NUMBERS = 11,
    TAP_NUMBERS = 1 + MAX_KERNELS,
    MAX_LONG_TAPS = 2 * MAX_WEIGHTS - 1,
    MAX_NUMBERS = AXIS_NUMBERS + TAP_NUMBERS * MAX_LONG_TAPS,
};
_Static_assert((int)VKB_MAX_TAPS <= (int)MAX_LONG_TAPS, "a description has space for all taps");

// All that a transpose follows from, as numbers. Returns how many there are.
static size_t describe(const struct vkb_axis *axis, uint32_t kernels, double *numbers)
{
    const double of_axis[AXIS_NUMBERS] = {
        axis->from, axis->to,        axis->origin, axis->step,   axis->kind, axis->border,
        axis->next, axis->backwards, axis->first,  axis->slopes, kernels,
    };
    const uint32_t count = vkb_axis_count(axis);

    memcpy(numbers, of_axis, sizeof of_axis);
    for (uint32_t i = 0; i < count; ++i) {
        const struct vkb_tap tap = vkb_axis_tap(axis, i);
        double *of_tap = numbers + AXIS_NUMBERS + (size_t)i * TAP_NUMBERS;
        of_tap[0] = tap.offset;
        memcpy(of_tap + 1, tap.weights, sizeof tap.weights);
    }
    return AXIS_NUMBERS + (size_t)count * TAP_NUMBERS;
}

// By half words: the upper bits of a double would change the upper bits of the hash only.
static uint64_t hash_of(const double *numbers, size_t count)
{
    uint64_t hash = VKB_HASH_START;

    for (size_t i = 0; i < count; ++i) {
        uint64_t bits;
        memcpy(&bits, &numbers[i], sizeof bits);
        hash = vkb_hash_word(vkb_hash_word(hash, bits >> 32), bits & UINT32_MAX);
    }
    return hash;
}

static void destroy(struct vkb_transposed *transposed)
{
    vkb_free(transposed->description);
    vkb_free(transposed->texels);
    vkb_free(transposed);
}

static size_t size_of(const struct vkb_transposed *transposed)
{
    return sizeof *transposed + transposed->described * sizeof(double)
         + transposed->count * sizeof *transposed->texels;
}

// Destroys the oldest ones: what is beyond so many bytes.
static void trim(struct vkb_transposes *transposes, size_t most)
{
    size_t old = 0;

    while (old < transposes->count && transposes->bytes > most) {
        struct vkb_transposed *oldest = transposes->kept[old++].transposed;
        transposes->bytes -= size_of(oldest);
        destroy(oldest);
    }
    transposes->count -= old;
    if (old)
        memmove(transposes->kept, transposes->kept + old,
                transposes->count * sizeof *transposes->kept);
}

void vkb_transposes_destroy(struct vkb_transposes *transposes)
{
    trim(transposes, 0);
    vkb_free(transposes->kept);
    *transposes = (struct vkb_transposes){.built = transposes->built};
}

static struct vkb_transposed *build(const struct vkb_axis *axis, uint32_t kernels,
                                    const double *numbers, size_t count, struct vkb_error *error)
{
    struct vkb_transposed *built = vkb_alloc(error, 1, sizeof *built);

    if (!built)
        return NULL;
    built->description = vkb_alloc(error, count, sizeof *numbers);
    if (!built->description || !vkb_axis_build(axis, kernels, built, error)) {
        destroy(built);
        return NULL;
    }
    memcpy(built->description, numbers, count * sizeof *numbers);
    built->described = count;
    return built;
}

// The transpose of an axis, which becomes the newest one, and the hash of its description; NULL on
// failure.
static const struct vkb_transposed *find(struct vkb_transposes *transposes,
                                         const struct vkb_axis *axis, uint32_t kernels,
                                         uint64_t *hash, struct vkb_error *error)
{
    double numbers[MAX_NUMBERS];
    const size_t count = describe(axis, kernels, numbers);
    size_t at = transposes->count;

    *hash = hash_of(numbers, count);
    while (at-- > 0) {
        const struct vkb_transposed *known = transposes->kept[at].transposed;
        if (transposes->kept[at].hash == *hash && known->described == count
            && memcmp(known->description, numbers, count * sizeof *numbers) == 0)
            break;
    }
    const bool is_new = at == SIZE_MAX;
    if (is_new
        && !vkb_grow(error, &transposes->kept, &transposes->capacity, transposes->count + 1,
                     sizeof *transposes->kept))
        return NULL;
    struct vkb_transposed *found =
        is_new ? build(axis, kernels, numbers, count, error) : transposes->kept[at].transposed;
    if (!found)
        return NULL;
    if (is_new) {
        transposes->bytes += size_of(found);
        found->number = transposes->built++;
        at = transposes->count++;
    }
    memmove(transposes->kept + at, transposes->kept + at + 1,
            (transposes->count - at - 1) * sizeof *transposes->kept);
    transposes->kept[transposes->count - 1].hash = *hash;
    transposes->kept[transposes->count - 1].transposed = found;
    return found;
}

void vkb_table_destroy(struct vkb_table *table)
{
    vkb_free(table->texels);
    vkb_free(table->parts);
}

// The first texel of a transpose in the table; SIZE_MAX: it is not there.
static size_t find_part(const struct vkb_table *table, const struct vkb_transposed *transposed)
{
    for (size_t i = 0; i < table->part_count; ++i)
        if (table->parts[i].number == transposed->number)
            return table->parts[i].start;
    return SIZE_MAX;
}

// Places count from the first texel of the table.
static bool append(const struct vkb_transposed *transposed, uint64_t hash, uint32_t entries,
                   struct vkb_table *table, struct vkb_error *error)
{
    const size_t start = table->count, count = start + transposed->count;

    if (count > MAX_TEXELS)
        return vkb_fail(error, VKB_ERROR_VALUE,
                        "derivatives: filters need %zu weights, more than %d", count, MAX_TEXELS);
    if (!vkb_grow(error, &table->texels, &table->capacity, count, sizeof *table->texels)
        || !vkb_grow(error, &table->parts, &table->part_capacity, table->part_count + 1,
                     sizeof *table->parts))
        return false;
    memcpy(table->texels + start, transposed->texels, transposed->count * sizeof *table->texels);
    for (uint32_t i = 0; i < entries; ++i)
        table->texels[start + i][2] += (float)start;
    table->parts[table->part_count].number = transposed->number;
    table->parts[table->part_count++].start = start;
    table->count = count;
    table->hash = vkb_hash_word(table->hash, hash);
    return true;
}

bool vkb_axis_transpose(struct vkb_axis *axis, uint32_t kernels, struct vkb_table *table,
                        struct vkb_error *error)
{
    uint64_t hash;
    const struct vkb_transposed *found = find(table->transposes, axis, kernels, &hash, error);

    if (!found)
        return false;
    const size_t known = find_part(table, found), start = known == SIZE_MAX ? table->count : known;
    const bool done = known != SIZE_MAX || append(found, hash, axis->from, table, error);
    if (done) {
        axis->readers = found->readers;
        axis->readers.start = (int32_t)start;
    }
    trim(table->transposes, MAX_KEPT_BYTES);
    return done;
}

bool vkb_table_end(struct vkb_table *table, struct vkb_graph *graph, uint32_t image,
                   struct vkb_error *error)
{
    const size_t rows = table->count / TABLE_WIDTH + 1, texels = rows * TABLE_WIDTH;
    struct vkb_image_row *row = &graph->images[image];

    if (!vkb_grow(error, &table->texels, &table->capacity, texels, sizeof *table->texels))
        return false;
    memset(table->texels[table->count], 0, (texels - table->count) * sizeof *table->texels);
    row->height = (uint32_t)rows;
    row->serial = table->hash ? table->hash : 1;
    row->pixels = graph->owned = table->texels;
    table->texels = NULL;
    return true;
}
