// The loops of host_fft.h, for vectors of LANES floats (host_lanes.h).
//
// A transform is Stockham's: each step transforms `factor` elements that are length / factor apart,
// multiplies them by turns, and stores them so that the last step leaves frequencies in their
// order.
#include "passes/host_fft.h"

// An element of LANES lines.
struct complex {
    lanes re, im;
};

INLINE void add_subtract(struct complex *a, struct complex *b)
{
    const struct complex sum = {a->re + b->re, a->im + b->im};

    b->re = a->re - b->re;
    b->im = a->im - b->im;
    *a = sum;
}

INLINE void transform_3(struct complex *v)
{
    const float root = 0.866025403784438647f;

    add_subtract(&v[1], &v[2]);
    const struct complex middle = {v[0].re - 0.5f * v[1].re, v[0].im - 0.5f * v[1].im};
    const struct complex turned = {root * v[2].im, -root * v[2].re};
    v[0] = (struct complex){v[0].re + v[1].re, v[0].im + v[1].im};
    v[1] = (struct complex){middle.re + turned.re, middle.im + turned.im};
    v[2] = (struct complex){middle.re - turned.re, middle.im - turned.im};
}

INLINE void transform_4(struct complex *v)
{
    add_subtract(&v[0], &v[2]);
    add_subtract(&v[1], &v[3]);
    const struct complex turned = {v[3].im, -v[3].re};
    const struct complex a = v[0], b = v[1], c = v[2];
    v[0] = (struct complex){a.re + b.re, a.im + b.im};
    v[1] = (struct complex){c.re + turned.re, c.im + turned.im};
    v[2] = (struct complex){a.re - b.re, a.im - b.im};
    v[3] = (struct complex){c.re - turned.re, c.im - turned.im};
}

INLINE void transform_5(struct complex *v)
{
    // Cosines and sines of 2 pi / 5 and 4 pi / 5.
    const float c1 = 0.309016994374947424f, c2 = -0.809016994374947424f;
    const float s1 = 0.951056516295153572f, s2 = 0.587785252292473129f;

    add_subtract(&v[1], &v[4]);
    add_subtract(&v[2], &v[3]);
    const struct complex a = v[1], b = v[2], c = v[4], d = v[3], middle = v[0];
    const struct complex p = {middle.re + c1 * a.re + c2 * b.re, middle.im + c1 * a.im + c2 * b.im};
    const struct complex q = {middle.re + c2 * a.re + c1 * b.re, middle.im + c2 * a.im + c1 * b.im};
    const struct complex r = {s1 * c.im + s2 * d.im, -(s1 * c.re + s2 * d.re)};
    const struct complex s = {s2 * c.im - s1 * d.im, -(s2 * c.re - s1 * d.re)};
    v[0] = (struct complex){middle.re + a.re + b.re, middle.im + a.im + b.im};
    v[1] = (struct complex){p.re + r.re, p.im + r.im};
    v[2] = (struct complex){q.re + s.re, q.im + s.im};
    v[3] = (struct complex){q.re - s.re, q.im - s.im};
    v[4] = (struct complex){p.re - r.re, p.im - r.im};
}

// One butterfly, of elements `apart`. `turns`: NULL where all are 1.
INLINE void transform_few(uint32_t factor, const struct complex *from, size_t apart,
                          struct complex *to, size_t apart_to, const float *turns)
{
    struct complex v[5];

    for (uint32_t j = 0; j < factor; ++j)
        v[j] = from[j * apart];
    if (factor == 2)
        add_subtract(&v[0], &v[1]);
    else if (factor == 3)
        transform_3(v);
    else if (factor == 4)
        transform_4(v);
    else
        transform_5(v);
    to[0] = v[0];
    for (uint32_t j = 1; j < factor; ++j) {
        const float c = turns ? turns[2 * j - 2] : 1.0f, s = turns ? turns[2 * j - 1] : 0.0f;
        to[j * apart_to] =
            turns ? (struct complex){v[j].re * c - v[j].im * s, v[j].re * s + v[j].im * c} : v[j];
    }
}

// A step, after those whose factors have the product `before`.
INLINE void take_step(uint32_t factor, uint32_t before, uint32_t rest, const float *turns,
                      const struct complex *from, struct complex *to)
{
    const size_t apart_to = (size_t)rest * before;

    for (uint32_t k = 0; k < before; ++k) {
        const struct complex *source = from + (size_t)k * factor * rest;
        struct complex *target = to + (size_t)k * rest;
        transform_few(factor, source, rest, target, apart_to, NULL);
        for (uint32_t i = 1; i < rest; ++i)
            transform_few(factor, source + i, rest, target + i, apart_to,
                          turns + (size_t)2 * i * (factor - 1));
    }
}

// Transforms `from`. Returns where the result is: there, or at `other`. The inverse is this one
// with real and imaginary parts exchanged, before and after it. It begins at a cache line: where
// the linker put its loops, a call of `blender_fog_glow` took up to a quarter longer (EPYC,
// 2026-11-29).
__attribute__((aligned(64))) static struct complex *
transform(const struct vkb_host_line *line, struct complex *from, struct complex *other)
{
    const float *turns = line->turns;
    uint32_t before = 1;

    for (uint32_t step = 0; step < line->factor_count; ++step) {
        const uint32_t factor = line->factors[step], rest = line->length / before / factor;
        struct complex *result = other;
        if (factor == 2)
            take_step(2, before, rest, turns, from, other);
        else if (factor == 3)
            take_step(3, before, rest, turns, from, other);
        else if (factor == 4)
            take_step(4, before, rest, turns, from, other);
        else
            take_step(5, before, rest, turns, from, other);
        turns += (size_t)2 * rest * (factor - 1);
        before *= factor;
        other = from;
        from = result;
    }
    return from;
}

// Rows: a pixel's four channels are in four lanes. Two rows, of which the second one is the
// imaginary part of the first one, so that one transform is for both.
enum { PIXELS = LANES / 4, BLOCK_ROWS = 2 * PIXELS };

static struct complex *space_of(const struct vkb_host_lines *work, uint32_t part)
{
    return (struct complex *)(void *)(work->space + part * work->space_size);
}

// The weights of a row of pixels; NULL: there are none.
INLINE const float *weights_of(const struct vkb_host_lines *work, int32_t y)
{
    const struct vkb_host_image *weights = &work->weights;

    return weights->pixels
             ? weights->pixels + clamped(y, weights->height) * weights->pitch + work->weight
             : NULL;
}

INLINE float weight_at(const struct vkb_host_lines *work, const float *weights, int32_t x)
{
    return weights[(size_t)4 * clamped(x, work->weights.width)];
}

// Multiplies pixels of every second row, whose weights are `rows`.
INLINE void weigh(const struct vkb_host_lines *work, const float *const rows[BLOCK_ROWS], int32_t x,
                  uint32_t second, lanes *pixels)
{
    lanes weights = {0};

    for (uint32_t i = 0; i < PIXELS; ++i) {
        const float weight = weight_at(work, rows[2 * i + second], x);
        const pixel four = {weight, weight, weight, weight};
        memcpy((char *)&weights + i * sizeof four, &four, sizeof four);
    }
    *pixels *= weights;
}

// Pixel x of every second row from `rows` on.
INLINE void load_pixels(const float *const rows[BLOCK_ROWS], size_t x, uint32_t second, lanes *to)
{
    for (uint32_t i = 0; i < PIXELS; ++i)
        memcpy((char *)to + i * sizeof(pixel), rows[2 * i + second] + 4 * x, sizeof(pixel));
}

// Blocks of LANES x LANES floats between lines and lanes.
INLINE void transpose(const float from[LANES][LANES], float to[LANES][LANES])
{
    for (uint32_t i = 0; i < LANES; ++i)
        for (uint32_t j = 0; j < LANES; ++j)
            to[j][i] = from[i][j];
}

enum { FIRST_RE, FIRST_IM, SECOND_RE, SECOND_IM, SPECTRA };

// Some frequencies of BLOCK_ROWS rows from y on: [row and part][frequency][lane].
typedef float spectra[SPECTRA][LANES][LANES];

// Copies frequencies k to before k + count between an image of spectra and `values`.
INLINE void move_spectra(const struct vkb_host_lines *work, const struct vkb_host_image *image,
                         uint32_t y, uint32_t k, uint32_t count, bool stores, spectra values)
{
    float turned[LANES][LANES];

    for (uint32_t part = 0; part < SPECTRA; ++part) {
        if (stores)
            transpose(values[part], turned);
        for (uint32_t i = 0; i < LANES; ++i) {
            const uint32_t row = y + 2 * (i / 4) + (part >= SECOND_RE), channel = i % 4;
            float *at = image->pixels + row * image->pitch
                      + (size_t)(2 * channel + part % 2) * work->half + k;
            if (row >= image->height || channel >= work->channels)
                memset(turned[i], 0, stores ? 0 : sizeof turned[i]);
            else if (stores && count == LANES)
                memcpy(at, turned[i], sizeof turned[i]);
            else if (stores)
                memcpy(at, turned[i], count * sizeof(float));
            else
                memcpy(turned[i], at, count * sizeof(float));
        }
        if (!stores)
            transpose(turned, values[part]);
    }
}

// The spectra of two rows at frequency j of some, from that of the first one and i times the second
// one there, and at the mirrored place.
INLINE void split_spectra(struct complex z, struct complex m, spectra values, uint32_t j)
{
    const lanes parts[SPECTRA] = {0.5f * (z.re + m.re), 0.5f * (z.im - m.im), 0.5f * (z.im + m.im),
                                  0.5f * (m.re - z.re)};

    for (uint32_t part = 0; part < SPECTRA; ++part)
        memcpy(values[part][j], &parts[part], sizeof parts[part]);
}

// Both rows' spectra.
static void store_spectra(const struct vkb_host_lines *work, const struct complex *line, uint32_t y)
{
    const uint32_t n = work->line.length;

    for (uint32_t k = 0; k < work->half; k += LANES) {
        const uint32_t count = least(LANES, work->half - k);
        spectra values;
        for (uint32_t j = 0; j < count; ++j)
            split_spectra(line[k + j], line[k + j ? n - k - j : 0], values, j);
        move_spectra(work, &work->target, y, k, count, true, values);
    }
}

static void rows_forth(void *context, uint32_t part, uint32_t first, uint32_t end)
{
    const struct vkb_host_lines *work = context;
    const struct vkb_host_image *source = &work->source;
    const uint32_t n = work->line.length;
    struct complex *line = space_of(work, part), *other = line + n;

    for (uint32_t y = 4 * first; y < least(4 * end, source->height); y += BLOCK_ROWS) {
        const float *rows[BLOCK_ROWS], *weights[BLOCK_ROWS];
        for (uint32_t i = 0; i < BLOCK_ROWS; ++i) {
            rows[i] = source->pixels + least(y + i, source->height - 1) * source->pitch;
            weights[i] = weights_of(work, (int32_t)(y + i));
        }
        for (uint32_t x = 0; x < n; ++x) {
            const int32_t place = work->places[x];
            struct complex *at = &line[x];
            if (place < 0) {
                *at = (struct complex){{0}, {0}};
                continue;
            }
            load_pixels(rows, (size_t)place, 0, &at->re);
            load_pixels(rows, (size_t)place, 1, &at->im);
            if (work->cleans) {
                clean(&at->re, true, (float)FFT_LIMIT);
                clean(&at->im, true, (float)FFT_LIMIT);
            }
            if (weights[0]) {
                weigh(work, weights, place, 0, &at->re);
                weigh(work, weights, place, 1, &at->im);
            }
        }
        store_spectra(work, transform(&work->line, line, other), y);
    }
}

// A row of a channel of a kernel at its places. False: it is 0.
static bool place_row(const struct vkb_host_lines *work, uint32_t y, uint32_t channel, float *to)
{
    // Grey kernels are images of one channel.
    const uint32_t n = work->line.length, apart = work->channels == 1 ? 1 : 4;
    const struct vkb_kernel_places *places = work->kernel_x;
    struct vkb_kernel_places rows = {0, -1, 1};

    memset(to, 0, n * sizeof *to);
    if (y < work->target.height)
        rows = work->kernel_y[y];
    for (int32_t j = rows.first; j <= rows.last; j += rows.step) {
        const float *from = work->source.pixels + (size_t)j * work->source.pitch + channel;
        for (uint32_t x = 0; x < n; ++x) {
            // Most places follow each other.
            const int32_t first = places[x].first;
            uint32_t count = 0;
            while (x + count < n && places[x + count].first == first + (int32_t)count
                   && places[x + count].last == first + (int32_t)count)
                ++count;
            for (uint32_t i = 0; i < count; ++i)
                to[x + i] += from[((size_t)first + i) * apart];
            for (int32_t i = first; count == 0 && i <= places[x].last; i += places[x].step)
                to[x] += from[(size_t)i * apart];
            x += count ? count - 1 : 0;
        }
    }
    for (uint32_t x = 0; x < n; ++x)
        to[x] *= work->gain;
    return rows.first <= rows.last;
}

// Every second one of 2 * LANES rows to the parts of a line.
INLINE void load_rows(const struct vkb_host_lines *work, const float *rows, uint32_t second,
                      struct complex *line)
{
    const uint32_t n = work->line.length;
    float from[LANES][LANES], to[LANES][LANES];

    for (uint32_t x = 0; x < n; x += LANES) {
        const uint32_t count = least(LANES, n - x);
        for (uint32_t i = 0; i < LANES; ++i)
            memcpy(from[i], rows + (size_t)(2 * i + second) * n + x, count * sizeof(float));
        transpose(from, to);
        for (uint32_t i = 0; i < count; ++i)
            memcpy(second ? &line[x + i].im : &line[x + i].re, to[i], sizeof to[i]);
    }
}

static void store_kernel(const struct vkb_host_lines *work, const struct complex *line, uint32_t y,
                         uint32_t channel)
{
    const uint32_t n = work->line.length;

    for (uint32_t k = 0; k < work->half; k += LANES) {
        const uint32_t count = least(LANES, work->half - k);
        float turned[LANES][LANES];
        spectra values;
        for (uint32_t j = 0; j < count; ++j)
            split_spectra(line[k + j], line[k + j ? n - k - j : 0], values, j);
        for (uint32_t part = 0; part < SPECTRA; ++part) {
            transpose(values[part], turned);
            for (uint32_t i = 0; i < LANES; ++i) {
                const uint32_t row = y + 2 * i + (part >= SECOND_RE);
                if (row < work->target.height)
                    memcpy(work->target.pixels + (size_t)row * work->target.pitch
                               + (size_t)(2 * channel + part % 2) * work->half + k,
                           turned[i], count * sizeof(float));
            }
        }
    }
}

static void kernel_rows(void *context, uint32_t part, uint32_t first, uint32_t end)
{
    const struct vkb_host_lines *work = context;
    const uint32_t n = work->line.length;
    struct complex *line = space_of(work, part), *other = line + n;
    float *rows = (float *)(other + n);

    for (uint32_t block = first; block < end; ++block)
        for (uint32_t channel = 0; channel < work->channels; ++channel) {
            bool placed = false;
            for (uint32_t i = 0; i < 2 * LANES; ++i)
                if (place_row(work, 2 * LANES * block + i, channel, rows + (size_t)i * n))
                    placed = true;
            load_rows(work, rows, 0, line);
            load_rows(work, rows, 1, line);
            // Rows of zeros have such spectra.
            store_kernel(work, placed ? transform(&work->line, line, other) : line,
                         2 * LANES * block, channel);
        }
}

// Both rows as one line, with real and imaginary parts exchanged.
static void load_spectra(const struct vkb_host_lines *work, struct complex *line, uint32_t y)
{
    const uint32_t n = work->line.length;

    for (uint32_t k = 0; k < work->half; k += LANES) {
        const uint32_t count = least(LANES, work->half - k);
        spectra values;
        move_spectra(work, &work->source, y, k, count, false, values);
        for (uint32_t j = 0; j < count; ++j) {
            lanes parts[SPECTRA];
            for (uint32_t part = 0; part < SPECTRA; ++part)
                memcpy(&parts[part], values[part][j], sizeof parts[part]);
            const uint32_t mirror = k + j ? n - k - j : 0;
            line[mirror] = (struct complex){parts[SECOND_RE] - parts[FIRST_IM],
                                            parts[FIRST_RE] + parts[SECOND_IM]};
            line[k + j] = (struct complex){parts[FIRST_IM] + parts[SECOND_RE],
                                           parts[FIRST_RE] - parts[SECOND_IM]};
        }
    }
}

// Stores pixel x of every second row from y on.
INLINE void store_pixels(const struct vkb_host_lines *work, uint32_t x, uint32_t y, lanes pixels)
{
    const struct vkb_host_image *target = &work->target, *added = &work->added;

    for (uint32_t i = 0; i < PIXELS && added->pixels; ++i)
        if (y + 2 * i < target->height)
            for (uint32_t c = 0; c < 4; ++c)
                pixels[4 * i + c] += added->pixels[(y + 2 * i) * added->pitch + (size_t)4 * x + c];
    if (work->stores)
        clean(&pixels, false, (float)SINGLE_LIMIT);
    for (uint32_t i = 0; i < PIXELS; ++i) {
        if (work->stores && work->opaque)
            pixels[4 * i + 3] = 1.0f;
        if (y + 2 * i < target->height)
            memcpy(target->pixels + (y + 2 * i) * target->pitch + (size_t)4 * x,
                   (char *)&pixels + i * sizeof(pixel), sizeof(pixel));
    }
}

static void rows_back(void *context, uint32_t part, uint32_t first, uint32_t end)
{
    const struct vkb_host_lines *work = context;
    struct complex *line = space_of(work, part), *other = line + work->line.length;

    for (uint32_t y = 4 * first; y < least(4 * end, work->target.height); y += BLOCK_ROWS) {
        load_spectra(work, line, y);
        // Exchanged: the first rows are imaginary.
        struct complex *result = transform(&work->line, line, other);
        const float *weights[BLOCK_ROWS];
        for (uint32_t i = 0; i < BLOCK_ROWS; ++i)
            weights[i] = weights_of(work, (int32_t)(y + i) - work->before_y);
        for (uint32_t x = 0; x < work->kept; ++x) {
            if (weights[0]) {
                weigh(work, weights, (int32_t)x - work->before_x, 0, &result[x].im);
                weigh(work, weights, (int32_t)x - work->before_x, 1, &result[x].re);
            }
            store_pixels(work, x, y, result[x].im);
            store_pixels(work, x, y + 1, result[x].re);
        }
    }
}

// Rows that are loaded to the caches before they are used: processors do not foresee such
// distances.
enum { AHEAD = 12 };

// LANES frequencies of a row of spectra, or the last ones.
INLINE lanes load_some(const float *from, uint32_t count)
{
    lanes value = {0};

    if (count == LANES)
        memcpy(&value, from, sizeof value);
    else
        memcpy(&value, from, count * sizeof(float));
    return value;
}

INLINE void store_some(float *to, uint32_t count, lanes value)
{
    if (count == LANES)
        memcpy(to, &value, sizeof value);
    else
        memcpy(to, &value, count * sizeof(float));
}

static void load_column(const struct vkb_host_lines *work, size_t at, uint32_t count,
                        struct complex *line)
{
    const size_t half = work->half;

    for (uint32_t y = 0; y < work->line.length; ++y) {
        const int32_t place = work->forth ? work->places[y] : (int32_t)y;
        line[y] = (struct complex){{0}, {0}};
        if (place < 0)
            continue;
        const float *from = work->source.pixels + (size_t)place * work->source.pitch + at;
        const float *later = from + AHEAD * work->source.pitch;
        __builtin_prefetch(later);
        __builtin_prefetch(later + half);
        line[y] = (struct complex){load_some(from, count), load_some(from + half, count)};
        if (work->forth && work->weights.pixels && !work->back) {
            const float weight = *weights_of(work, place);
            line[y].re *= weight;
            line[y].im *= weight;
        }
    }
}

static void multiply_column(const struct vkb_host_lines *work, size_t at, uint32_t count,
                            struct complex *line)
{
    for (uint32_t y = 0; y < work->line.length; ++y) {
        const float *from = work->kernel.pixels + (size_t)y * work->kernel.pitch + at;
        const float *later = from + AHEAD * work->kernel.pitch;
        __builtin_prefetch(later);
        __builtin_prefetch(later + work->half);
        const struct complex v = line[y];
        const lanes re = load_some(from, count);
        const lanes im = work->kernel_sign * load_some(from + work->half, count);
        line[y] = (struct complex){v.re * re - v.im * im, v.re * im + v.im * re};
    }
}

static void exchange(struct complex *line, uint32_t length)
{
    for (uint32_t y = 0; y < length; ++y)
        line[y] = (struct complex){line[y].im, line[y].re};
}

static void store_column(const struct vkb_host_lines *work, size_t at, uint32_t count,
                         const struct complex *line)
{
    const struct vkb_host_image *target = &work->target, *added = &work->added;

    for (uint32_t y = 0; y < work->kept; ++y) {
        float *to = target->pixels + (size_t)y * target->pitch + at;
        __builtin_prefetch(to + AHEAD * target->pitch, 1);
        __builtin_prefetch(to + AHEAD * target->pitch + work->half, 1);
        struct complex v = line[y];
        if (work->back && work->weights.pixels) {
            const float weight = *weights_of(work, (int32_t)y - work->before_y);
            v.re *= weight;
            v.im *= weight;
        }
        if (added->pixels) {
            const float *more = added->pixels + (size_t)y * added->pitch + at;
            v.re += load_some(more, count);
            v.im += load_some(more + work->half, count);
        }
        store_some(to, count, v.re);
        store_some(to + work->half, count, v.im);
    }
}

static void columns(void *context, uint32_t part, uint32_t first, uint32_t end)
{
    const struct vkb_host_lines *work = context;
    const uint32_t n = work->line.length, blocks = (work->half + LANES - 1) / LANES;

    for (uint32_t block = first; block < end; ++block) {
        struct complex *line = space_of(work, part), *other = line + n;
        const uint32_t k = block % blocks * LANES, count = least(LANES, work->half - k);
        const size_t at = (size_t)2 * (block / blocks) * work->half + k;
        load_column(work, at, count, line);
        if (work->forth) {
            struct complex *result = transform(&work->line, line, other);
            other = result == line ? other : line;
            line = result;
        }
        if (work->kernel.pixels)
            multiply_column(work, vkb_host_is_grey(&work->kernel, work->half) ? k : at, count,
                            line);
        if (work->back) {
            exchange(line, n);
            line = transform(&work->line, line, other);
            exchange(line, work->kept);
        }
        store_column(work, at, count, line);
    }
}
