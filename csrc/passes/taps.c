#include "passes/taps.h"

#include <math.h>
#include <string.h>

double vkb_axis_readers(const struct vkb_axis *axis)
{
    double low = 0.0, high = 0.0;

    for (uint32_t i = 0; i < vkb_axis_count(axis); ++i) {
        const double offset = vkb_axis_tap(axis, i).offset;
        low = fmin(low, offset);
        high = fmax(high, offset);
    }
    // Of pixels beyond an edge that is repeated, all read the outermost texel.
    const double end = axis->origin + axis->step * (axis->to - 1.0) + high - (axis->from - 1.0);
    const double beyond =
        axis->border == VKB_BORDER_ZERO ? 0.0 : fmax(-(axis->origin + low), end) / axis->step;
    const double apart = axis->border >= VKB_BORDER_LAST ? axis->step : 1.0;
    return fmax(((high - low) * apart + (axis->kind == UPSAMPLE_CUBIC ? 4.0 : 2.0))
                    / fabs(axis->step),
                beyond);
}

// The texels from `first` on that a pixel samples with a tap, and their shares.
struct sample {
    double first;
    uint32_t count;
    double shares[4];
};

// The pixel whose sample a tap reads at pixel `at`, which may be beyond the edges.
static double at_border(const struct vkb_axis *axis, double at)
{
    const double last = axis->to - 1.0, odd = fmod(fabs(at), 2.0);
    const double pair = fmin(fmax(at - odd, 0.0), fmax(axis->to - 2.0, 0.0));

    if (axis->border == VKB_BORDER_PAIRS)
        return fmin(pair + odd, last);
    return fmin(axis->border == VKB_BORDER_FIRST_TWO && at < 0.0 ? odd : at, last);
}

// The step from a texel to the one that is read for it.
static double next_step(const struct vkb_axis *axis, double at)
{
    const double counted = axis->backwards ? axis->from - 1.0 - at : at;

    for (int bit = 0; axis->next >> bit; ++bit)
        if ((axis->next >> bit & 1) && counted == (bit ? ldexp(1.0, bit - 1) : 0.0))
            return axis->backwards ? -1.0 : 1.0;
    return 0.0;
}

bool vkb_is_centred(double position)
{
    return fabs(position - floor(position + 0.5)) < 1e-9;
}

static double position_of(const struct vkb_axis *axis, uint32_t pixel, double offset)
{
    const double position = axis->border >= VKB_BORDER_LAST
                              ? axis->origin + axis->step * at_border(axis, pixel + offset)
                              : axis->origin + axis->step * pixel + offset;
    const double settled = vkb_is_centred(position) ? floor(position + 0.5) : position;

    return settled + next_step(axis, floor(settled));
}

static struct sample linear_sample(double position)
{
    const double texel = floor(position), part = position - texel;

    return (struct sample){texel, part > 0.0 ? 2 : 1, {1.0 - part, part}};
}

// The derivative of a linear sample by a factor of the tap's offset: on a texel's centre the mean
// of both sides.
static struct sample slope_sample(double position, double offset)
{
    const double texel = floor(position);

    return position > texel ? (struct sample){texel, 2, {-offset, offset}}
                            : (struct sample){texel - 1.0, 3, {-0.5 * offset, 0.0, 0.5 * offset}};
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
    case UPSAMPLE_LEFT_PAIR:
        return linear_sample(position + PAIR_PLACE(-1, part));
    case UPSAMPLE_RIGHT_PAIR:
        return linear_sample(position + PAIR_PLACE(1, part));
    default:
        return axis->slopes ? slope_sample(position, offset) : linear_sample(position);
    }
}

// The texel that is read; `from` if there is none.
static uint32_t read_texel(const struct vkb_axis *axis, double texel)
{
    const double within = fmin(fmax(texel, 0.0), axis->from - 1.0);

    return axis->border == VKB_BORDER_ZERO && texel != within ? axis->from : (uint32_t)within;
}

// The pixels that read a texel, and where their weights begin.
struct readers {
    uint32_t first, end;
    size_t start;
};

// Taps of a long kernel may have none.
static bool has_weight(const struct vkb_tap *tap)
{
    return tap->offset == 0.0 || tap->weights[0] != 0.0 || tap->weights[1] != 0.0
        || tap->weights[2] != 0.0;
}

static size_t find_readers(const struct vkb_axis *axis, struct readers *readers)
{
    const uint32_t count = vkb_axis_count(axis);
    size_t total = 0;

    for (uint32_t pixel = 0; pixel < axis->to; ++pixel)
        for (uint32_t tap = 0; tap < count; ++tap) {
            const struct vkb_tap taken = vkb_axis_tap(axis, tap);
            const struct sample sample = sample_at(axis, pixel, taken.offset);
            for (uint32_t i = 0; has_weight(&taken) && i < sample.count; ++i) {
                const uint32_t read = read_texel(axis, sample.first + i);
                struct readers *texel = &readers[read];
                if (read == axis->from)
                    continue;
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
                        double (*weights)[MAX_KERNELS])
{
    const uint32_t count = vkb_axis_count(axis);

    for (uint32_t pixel = 0; pixel < axis->to; ++pixel)
        for (uint32_t tap = 0; tap < count; ++tap) {
            const struct vkb_tap taken = vkb_axis_tap(axis, tap);
            const struct sample sample = sample_at(axis, pixel, taken.offset);
            for (uint32_t i = 0; has_weight(&taken) && i < sample.count; ++i) {
                const uint32_t read = read_texel(axis, sample.first + i);
                const struct readers *texel = &readers[read];
                if (read == axis->from)
                    continue;
                double *sums = weights[texel->start + pixel - texel->first];
                for (int kernel = 0; kernel < MAX_KERNELS; ++kernel)
                    sums[kernel] += sample.shares[i] * taken.weights[kernel];
            }
        }
}

// Texels in the middle of an axis, from `at` on, and the pixels that read them, whose weights are
// those of the block before, again and again.
struct repeat {
    uint32_t at, texels, pixels;
};

static bool repeats(const struct repeat *repeat, uint32_t texel)
{
    return texel >= repeat->at && texel < repeat->at + repeat->texels;
}

// Of positions in a simple ratio. Without it a plan of new distances at 3840 x 2160 takes 7.2 ms in
// place of 1.2 (DualKawase, 2026-11-30).
static struct repeat find_repeat(const struct vkb_axis *axis)
{
    const double end = axis->origin + axis->step * (axis->to - 1.0) - (axis->from - 1.0);
    double reach = fmax(fabs(axis->origin), fabs(end));

    for (uint32_t i = 0; i < vkb_axis_count(axis); ++i)
        reach = fmax(reach, fabs(vkb_axis_tap(axis, i).offset));
    // Samples, and the sum of both distances.
    const double edge = 2.0 * reach + 4.0, middle = axis->from - 2.0 * edge - 3.0 * ADJOINT_SIDE;
    if (vkb_axis_ratio(axis) == 0 || axis->border > VKB_BORDER_ZERO || axis->next != 0
        || middle <= 0.0)
        return (struct repeat){0};
    const uint32_t blocks = (uint32_t)middle / ADJOINT_SIDE;
    return (struct repeat){
        .at = ((uint32_t)edge / ADJOINT_SIDE + 2) * ADJOINT_SIDE,
        .texels = blocks * ADJOINT_SIDE,
        .pixels = (uint32_t)(blocks * ADJOINT_SIDE / axis->step),
    };
}

// Adds the readers that were left out.
static void repeat_readers(const struct repeat *repeat, uint32_t count, struct readers *readers)
{
    const uint32_t pixels = repeat->texels ? repeat->pixels / (repeat->texels / ADJOINT_SIDE) : 0;

    memmove(readers + repeat->at + repeat->texels, readers + repeat->at,
            (count - repeat->at) * sizeof *readers);
    for (uint32_t texel = repeat->at; texel < count + repeat->texels; ++texel) {
        const bool is_new = repeats(repeat, texel);
        struct readers *own = &readers[texel];
        if (is_new)
            *own = readers[texel - ADJOINT_SIDE];
        own->first += is_new ? pixels : repeat->pixels;
        own->end += is_new ? pixels : repeat->pixels;
    }
}

// The pixels that read the texels of a block. Those of an axis that is mirrored come in the
// opposite order.
static struct readers readers_of_block(const struct vkb_axis *axis, const struct readers *readers,
                                       uint32_t block)
{
    struct readers all = readers[block];

    for (uint32_t texel = block; texel < block + ADJOINT_SIDE && texel < axis->from; ++texel) {
        all.first = readers[texel].first < all.first ? readers[texel].first : all.first;
        all.end = readers[texel].end > all.end ? readers[texel].end : all.end;
    }
    return all;
}

// The number of pixels whose weights each block has; 0: those of blocks differ too much, as where
// most pixels read an edge. (With lists of one length the table of Blender's ghosts had 122 MB at
// 3840 x 2160 in place of 2.4, and a plan of its derivatives took 125 ms in place of 1.)
static uint32_t span_of_blocks(const struct vkb_axis *axis, const struct readers *readers)
{
    uint64_t all = 0, blocks = 0;
    uint32_t most = 1;

    for (uint32_t block = 0; block < axis->from; block += ADJOINT_SIDE, ++blocks) {
        const struct readers own = readers_of_block(axis, readers, block);
        most = own.end - own.first > most ? own.end - own.first : most;
        all += own.end - own.first;
    }
    return most <= MAX_READERS || blocks * most <= 4 * all ? most : 0;
}

// Writes the weights of a block: of pixels from `first` on.
static void write_weights(const struct vkb_axis *axis, uint32_t block, uint32_t first,
                          uint32_t kernels, const struct readers *readers,
                          double (*weights)[MAX_KERNELS], float (*to)[4])
{
    for (uint32_t i = 0; i < ADJOINT_SIDE && block + i < axis->from; ++i) {
        const struct readers *texel = &readers[block + i];
        for (uint32_t pixel = texel->first; pixel < texel->end; ++pixel) {
            const double *found = weights[texel->start + pixel - texel->first];
            for (uint32_t kernel = 0; kernel < kernels; ++kernel)
                to[kernels * (pixel - first) + kernel][i] = (float)found[kernel];
        }
    }
}

// Writes entries, and a list of weights for each block that differs from the one before. Places
// count from the first entry.
static bool write_table(const struct vkb_axis *axis, uint32_t kernels, const struct repeat *repeat,
                        const struct readers *readers, double (*weights)[MAX_KERNELS],
                        struct vkb_transposed *found, struct vkb_error *error)
{
    size_t capacity = 0, place = 0, size_before = 0;

    found->count = axis->from;
    for (uint32_t block = 0; block < axis->from; block += ADJOINT_SIDE) {
        const struct readers own = readers_of_block(axis, readers, block);
        const uint32_t first = own.first, span = (uint32_t)found->readers.span;
        const size_t size = (size_t)kernels * (span ? span : own.end - own.first);
        if (!repeats(repeat, block)) {
            if (!vkb_grow(error, &found->texels, &capacity, found->count + size,
                          sizeof *found->texels))
                return false;
            float (*list)[4] = found->texels + found->count;
            memset(list, 0, size * sizeof *list);
            write_weights(axis, block, first, kernels, readers, weights, list);
            if (!place || size != size_before
                || memcmp(found->texels[place], list, size * sizeof *list) != 0) {
                place = found->count;
                found->count += size;
                size_before = size;
            }
        }
        for (uint32_t texel = block; texel < block + ADJOINT_SIDE && texel < axis->from; ++texel) {
            float *entry = found->texels[texel];
            entry[0] = (float)(axis->first + readers[texel].first);
            entry[1] = (float)(readers[texel].end - readers[texel].first);
            entry[2] = (float)place;
            entry[3] = (float)(axis->first + first);
        }
    }
    return true;
}

// The most readers of a texel from `first` to before `end`; too many for tiles where those of a
// texel begin before those of the one before.
static int32_t most_readers(const struct readers *readers, uint32_t first, uint32_t end)
{
    uint32_t most = 1;

    for (uint32_t texel = first; texel < end; ++texel) {
        const uint32_t count = readers[texel].end - readers[texel].first;
        if (texel > 0 && readers[texel].first < readers[texel - 1].first)
            return MAX_READERS + 1;
        most = count > most ? count : most;
    }
    return (int32_t)most;
}

// The size of the windows that the ratio of sides gives, if all readers are in these; else 0.
static int32_t find_window(const struct vkb_axis *axis, const struct repeat *repeat,
                           const struct readers *readers, int32_t most)
{
    const int32_t ratio = vkb_ratio_of(axis->to, axis->from);
    const int32_t size = ratio == EXACT_SAME ? most : most + most % 2;
    bool fits = ratio != 0 && axis->first == 0;

    for (uint32_t texel = 0; fits && texel < axis->from; ++texel) {
        if (repeats(repeat, texel))
            continue;
        const int32_t first = WINDOW_FIRST(ratio, (int32_t)texel, size);
        fits =
            (int32_t)readers[texel].first >= first && (int32_t)readers[texel].end <= first + size;
    }
    return fits ? size : 0;
}

// The weight that a texel has in a pixel of its window.
static float weight_in(const struct readers *readers, uint32_t texel, int32_t pixel,
                       double (*weights)[MAX_KERNELS])
{
    const struct readers *of = &readers[texel];
    const int32_t at = pixel - (int32_t)of->first;

    return at >= 0 && pixel < (int32_t)of->end ? (float)weights[of->start + (size_t)at][0] : 0.0f;
}

// Takes the weights in the middle of the axis, and compares those of the other texels with them.
// Those of ghosts differ.
static void find_inner(const struct vkb_axis *axis, const struct repeat *repeat,
                       const struct readers *readers, double (*weights)[MAX_KERNELS],
                       struct vkb_readers *found)
{
    const int32_t ratio = vkb_ratio_of(axis->to, axis->from), window = found->window;
    const uint32_t middle = axis->from / 2 & ~1u;

    found->repeats = window > 0 && window <= FILTER_TILE_WINDOW;
    for (uint32_t texel = middle; found->repeats && texel < middle + 2 && texel < axis->from;
         ++texel)
        for (int32_t i = 0; i < window; ++i)
            found->inner[(texel & 1) * 2 + i / 4][i % 4] =
                weight_in(readers, texel, WINDOW_FIRST(ratio, (int32_t)texel, window) + i, weights);
    for (uint32_t texel = 0; found->repeats && texel < axis->from; ++texel) {
        const int32_t first = WINDOW_FIRST(ratio, (int32_t)texel, window);
        if (first < window || first + 2 * window > (int32_t)axis->to || repeats(repeat, texel))
            continue;
        for (int32_t i = 0; i < window; ++i)
            found->repeats = found->repeats
                          && fabsf(found->inner[(texel & 1) * 2 + i / 4][i % 4]
                                   - weight_in(readers, texel, first + i, weights))
                                 <= 1e-6f;
    }
}

const struct vkb_readers vkb_kept_readers = {
    .start = -1, .span = 1, .most = 1, .usual = 1, .window = 1};

bool vkb_axis_build(const struct vkb_axis *axis, uint32_t kernels, struct vkb_transposed *found,
                    struct vkb_error *error)
{
    const struct repeat repeat = find_repeat(axis);
    struct vkb_axis ends = *axis;
    ends.from -= repeat.texels;
    ends.to -= repeat.pixels;
    struct readers *readers = vkb_alloc(error, axis->from, sizeof *readers);
    double (*weights)[MAX_KERNELS] =
        readers ? vkb_alloc(error, find_readers(&ends, readers), sizeof *weights) : NULL;
    bool done = weights != NULL;

    if (done) {
        add_weights(&ends, readers, weights);
        repeat_readers(&repeat, ends.from, readers);
        found->readers.span = (int32_t)span_of_blocks(axis, readers);
        found->readers.most = most_readers(readers, 0, axis->from);
        found->readers.usual = most_readers(readers, axis->from / 4, axis->from - axis->from / 4);
        found->readers.window = find_window(axis, &repeat, readers, found->readers.most);
        if (kernels == 1)
            find_inner(axis, &repeat, readers, weights, &found->readers);
        done = write_table(axis, kernels, &repeat, readers, weights, found, error);
    }
    vkb_free(weights);
    vkb_free(readers);
    return done;
}
