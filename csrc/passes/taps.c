#include "passes/taps.h"

#include <math.h>
#include <string.h>

// Lists of weights that are compared with the next one. Sizes in a simple ratio have as many.
enum { RECENT = 8 };

// Floats count up to this number.
enum { MAX_TEXELS = 1 << 24 };

static void begin_axis(uint32_t from, uint32_t to, struct vkb_axis *axis)
{
    const struct vkb_tap centre = {.weights = {1.0}};
    const double step = (double)from / to;

    *axis = (struct vkb_axis){
        .from = from, .to = to, .origin = 0.5 * step - 0.5, .step = step, .kind = UPSAMPLE_LINEAR};
    vkb_axis_set(axis, &centre, 1);
}

void vkb_filter_begin(const struct vkb_graph *graph, uint32_t from, uint32_t to,
                      struct vkb_filter *filter)
{
    const struct vkb_image_row *source = &graph->images[from], *target = &graph->images[to];

    begin_axis(source->width, target->width, &filter->x);
    begin_axis(source->height, target->height, &filter->y);
    filter->kernels = 1;
    filter->gain = 1.0;
}

void vkb_axis_move(struct vkb_axis *axis, uint32_t from, uint32_t to, double origin)
{
    begin_axis(from, to, axis);
    axis->origin = origin;
    axis->step = 1.0;
}

void vkb_axis_set(struct vkb_axis *axis, const struct vkb_tap *taps, uint32_t count)
{
    memcpy(axis->taps, taps, count * sizeof *taps);
    axis->count = count;
}

bool vkb_axis_is_identity(const struct vkb_axis *axis)
{
    return axis->from == axis->to && axis->origin == 0.0 && axis->step == 1.0 && axis->first == 0
        && axis->kind == UPSAMPLE_LINEAR && axis->count == 1 && axis->taps[0].offset == 0.0
        && axis->taps[0].weights[0] == 1.0;
}

double vkb_axis_readers(const struct vkb_axis *axis)
{
    double low = 0.0, high = 0.0;

    for (uint32_t i = 0; i < axis->count; ++i) {
        low = fmin(low, axis->taps[i].offset);
        high = fmax(high, axis->taps[i].offset);
    }
    return (high - low + (axis->kind == UPSAMPLE_CUBIC ? 4.0 : 2.0)) / axis->step;
}

// The texels from `first` on that a pixel samples with a tap, and their shares.
struct sample {
    double first;
    uint32_t count;
    double shares[4];
};

static double position_of(const struct vkb_axis *axis, uint32_t pixel, double offset)
{
    const double position = axis->origin + axis->step * pixel + offset;
    // A texel's centre is met with roundings.
    const double nearest = floor(position + 0.5);

    return fabs(position - nearest) < 1e-9 ? nearest : position;
}

static struct sample linear_sample(double position)
{
    const double texel = floor(position), part = position - texel;

    return (struct sample){texel, part > 0.0 ? 2 : 1, {1.0 - part, part}};
}

static struct sample cubic_sample(double position)
{
    const double texel = floor(position), part = position - texel, rest = 1.0 - part;

    return (struct sample){
        texel - 1.0,
        4,
        {rest * rest * rest / 6.0, (4.0 - 3.0 * part * part * (2.0 - part)) / 6.0,
         (4.0 - 3.0 * rest * rest * (2.0 - rest)) / 6.0, part * part * part / 6.0},
    };
}

// The half of the cubic sample on the side of the offset, as a linear one.
static struct sample inset_cubic_sample(const struct vkb_axis *axis, double position, double offset)
{
    const struct sample cubic = cubic_sample(position);
    const double *shares = offset < 0.0 ? cubic.shares : cubic.shares + 2;
    const double sum = shares[0] + shares[1], furthest = axis->from - 0.5 - axis->step;
    struct sample half =
        linear_sample(fmin(cubic.first + 1.0 + offset + shares[1] / sum, furthest));

    half.shares[0] *= sum;
    half.shares[1] *= sum;
    return half;
}

static struct sample sample_at(const struct vkb_axis *axis, uint32_t pixel, double offset)
{
    const double position = position_of(axis, pixel, offset);
    const double texel = floor(position), part = position - texel;
    const double inset = fmin(position, axis->from - 1.5);

    switch (axis->kind) {
    case UPSAMPLE_CUBIC:
        return cubic_sample(position);
    case UPSAMPLE_INSIDE:
        if (offset != 0.0 && (position < -0.5001 || position > axis->from - 0.4999))
            return (struct sample){.count = 0};
        return linear_sample(position);
    case UPSAMPLE_INSET_LINEAR:
        return linear_sample(inset);
    case UPSAMPLE_INSET_CUBIC:
        return inset_cubic_sample(axis, fmin(position - offset, axis->from - 1.5), offset);
    // Filament's reduction: the texels around a position have the weights (1 - f, 2 - f, 1 + f, f).
    // The first two of them, or the last two, divided by their sum.
    case UPSAMPLE_LEFT_PAIR:
        return linear_sample(texel - 1.0 + (2.0 - part) / (3.0 - 2.0 * part));
    case UPSAMPLE_RIGHT_PAIR:
        return linear_sample(texel + 1.0 + part / (1.0 + 2.0 * part));
    default:
        return linear_sample(position);
    }
}

static uint32_t read_texel(const struct vkb_axis *axis, double texel)
{
    return (uint32_t)fmin(fmax(texel, 0.0), axis->from - 1.0);
}

// The pixels that read a texel, and where their weights begin.
struct readers {
    uint32_t first, end;
    size_t start;
};

static size_t find_readers(const struct vkb_axis *axis, struct readers *readers)
{
    size_t total = 0;

    for (uint32_t pixel = 0; pixel < axis->to; ++pixel)
        for (uint32_t tap = 0; tap < axis->count; ++tap) {
            const struct sample sample = sample_at(axis, pixel, axis->taps[tap].offset);
            for (uint32_t i = 0; i < sample.count; ++i) {
                struct readers *texel = &readers[read_texel(axis, sample.first + i)];
                if (!texel->end)
                    texel->first = pixel;
                texel->end = pixel + 1;
            }
        }
    for (uint32_t texel = 0; texel < axis->from; ++texel) {
        // One that no pixel reads has the pixels of the one before, without a share in them. So
        // adjacent texels have adjacent readers.
        if (!readers[texel].end)
            readers[texel] = texel ? readers[texel - 1] : (struct readers){.end = 1};
        readers[texel].start = total;
        total += readers[texel].end - readers[texel].first;
    }
    return total;
}

static void add_weights(const struct vkb_axis *axis, const struct readers *readers,
                        double (*weights)[VKB_MAX_KERNELS])
{
    for (uint32_t pixel = 0; pixel < axis->to; ++pixel)
        for (uint32_t tap = 0; tap < axis->count; ++tap) {
            const struct sample sample = sample_at(axis, pixel, axis->taps[tap].offset);
            for (uint32_t i = 0; i < sample.count; ++i) {
                const struct readers *texel = &readers[read_texel(axis, sample.first + i)];
                double *sums = weights[texel->start + pixel - texel->first];
                for (int kernel = 0; kernel < VKB_MAX_KERNELS; ++kernel)
                    sums[kernel] += sample.shares[i] * axis->taps[tap].weights[kernel];
            }
        }
}

// Lists of weights in a table.
struct list {
    size_t place, count;
};

// Where the list at the end of the table is already; its own place if it is new.
static size_t place_list(struct vkb_table *table, size_t count, struct list lists[RECENT],
                         uint32_t *next)
{
    const size_t size = count * sizeof *table->texels;

    for (int i = 0; i < RECENT; ++i)
        if (lists[i].count == count
            && memcmp(table->texels[lists[i].place], table->texels[table->count], size) == 0)
            return lists[i].place;
    lists[(*next)++ % RECENT] = (struct list){table->count, count};
    table->count += count;
    return table->count - count;
}

static bool write_table(const struct vkb_axis *axis, bool kernels, const struct readers *readers,
                        double (*weights)[VKB_MAX_KERNELS], struct vkb_table *table,
                        struct vkb_error *error)
{
    const size_t start = table->count;
    struct list lists[RECENT] = {0};
    uint32_t next = 0;

    if (!vkb_grow(error, &table->texels, &table->capacity, start + axis->from,
                  sizeof *table->texels))
        return false;
    table->count += axis->from;
    for (uint32_t texel = 0; texel < axis->from; ++texel) {
        const struct readers *row = &readers[texel];
        const uint32_t count = row->end - row->first, size = kernels ? count : (count + 3) / 4;
        if (!vkb_grow(error, &table->texels, &table->capacity, table->count + size,
                      sizeof *table->texels))
            return false;
        float *to = table->count < table->capacity ? table->texels[table->count] : NULL;
        for (uint32_t i = 0; i < 4 * size; ++i) {
            const uint32_t reader = kernels ? i / 4 : i, kernel = kernels ? i % 4 : 0;
            to[i] = reader < count ? (float)weights[row->start + reader][kernel] : 0.0f;
        }
        const size_t place = place_list(table, size, lists, &next);
        table->texels[start + texel][0] = (float)(axis->first + row->first);
        table->texels[start + texel][1] = (float)count;
        table->texels[start + texel][2] = (float)place;
        table->texels[start + texel][3] = 0.0f;
    }
    return table->count <= MAX_TEXELS
        || vkb_fail(error, VKB_ERROR_VALUE, "derivatives: filters need %zu weights, more than %d",
                    table->count, MAX_TEXELS);
}

bool vkb_axis_transpose(const struct vkb_axis *axis, bool kernels, struct vkb_table *table,
                        uint32_t *start, struct vkb_error *error)
{
    struct readers *readers = vkb_alloc(error, axis->from, sizeof *readers);
    double (*weights)[VKB_MAX_KERNELS] =
        readers ? vkb_alloc(error, find_readers(axis, readers), sizeof *weights) : NULL;
    bool done = weights != NULL;

    *start = (uint32_t)table->count;
    if (done) {
        add_weights(axis, readers, weights);
        done = write_table(axis, kernels, readers, weights, table, error);
    }
    vkb_free(weights);
    vkb_free(readers);
    return done;
}

// Texels are four words of 32 bits, taken by two.
static uint64_t hash_of(const struct vkb_table *table)
{
    uint64_t hash = VKB_HASH_START;

    for (size_t i = 0; i < 2 * table->count; ++i) {
        uint64_t word;
        memcpy(&word, &table->texels[i / 2][i % 2 * 2], sizeof word);
        hash = vkb_hash_word(hash, word);
    }
    return hash ? hash : 1;
}

bool vkb_table_end(struct vkb_table *table, struct vkb_graph *graph, uint32_t image,
                   struct vkb_error *error)
{
    const size_t rows = table->count / TABLE_WIDTH + 1, texels = rows * TABLE_WIDTH;
    struct vkb_image_row *row = &graph->images[image];
    const bool done =
        vkb_grow(error, &table->texels, &table->capacity, texels, sizeof *table->texels);

    if (done) {
        memset(table->texels[table->count], 0, (texels - table->count) * sizeof *table->texels);
        table->count = texels;
        row->height = (uint32_t)rows;
        row->serial = hash_of(table);
        vkb_free(graph->owned[0]);
        row->pixels = graph->owned[0] = table->texels;
    } else {
        vkb_free(table->texels);
    }
    *table = (struct vkb_table){0};
    return done;
}
