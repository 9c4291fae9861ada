// The loop of host_ghosts.h, with the conversions of half floats that processors with AVX2 have. It
// computes what ghosts.frag does, with the names of lib/flare.glsl.
#include "passes/host_ghosts.h"

#include <math.h>

// A ghost in a row: the two rows of texels that it samples, their weights, and the square of its
// share of the way to the border.
struct ghost_row {
    const struct vkb_ghost_column *columns;
    const uint16_t *upper, *lower;
    float above, below, share;
    pixel tint;
};

INLINE const uint16_t *halves_at(const struct vkb_host_image *image, uint32_t row)
{
    return (const uint16_t *)(image->pixels + row * image->pitch);
}

// False: none of its samples is in the image.
INLINE bool find_row(const struct vkb_host_ghosts *work, uint32_t ghost, uint32_t y,
                     struct ghost_row *row)
{
    const float *values = work->params->ghosts[ghost];
    const float height = (float)work->source.height, centre = 0.5f * height - 0.5f;
    const float start = floorf(centre), offset = values[3] * ((float)y + 0.5f - 0.5f * height);
    const float moved = centre - start + offset, whole = floorf(moved), part = moved - whole;
    const int32_t texel = (int32_t)(start + whole);
    const uint32_t low = clamped(texel, work->source.height);
    const uint32_t high = clamped(texel + 1, work->source.height);
    const float share = offset / height;

    *row = (struct ghost_row){
        .columns = work->columns + (size_t)ghost * work->target.width,
        .upper = halves_at(&work->source, low),
        .lower = halves_at(&work->source, high),
        .above = (int32_t)low == texel ? 1.0f - part : 0.0f,
        .below = (int32_t)high == texel + 1 ? part : 0.0f,
        .share = share * share,
        .tint = {values[0], values[1], values[2], (values[0] + values[1] + values[2]) / 3.0f},
    };
    return row->above > 0.0f || row->below > 0.0f;
}

INLINE pixel halves_to_pixel(const uint16_t *halves)
{
    return (pixel)_mm_cvtph_ps(_mm_loadl_epi64((const __m128i *)halves));
}

// Two texels of a row, by their weights.
INLINE pixel sample_row(const uint16_t *halves, __m256 weights)
{
    const __m256 both =
        _mm256_mul_ps(weights, _mm256_cvtph_ps(_mm_loadu_si128((const __m128i *)halves)));

    return (pixel)_mm_add_ps(_mm256_castps256_ps128(both), _mm256_extractf128_ps(both, 1));
}

INLINE void store_halves(pixel value, uint16_t *halves)
{
    const __m128 limit = _mm_set1_ps(65504.0f);
    const __m128 limited =
        _mm_min_ps(_mm_max_ps((__m128)value, _mm_sub_ps(_mm_setzero_ps(), limit)), limit);

    _mm_storel_epi64((__m128i *)halves, _mm_cvtps_ph(limited, _MM_FROUND_TO_NEAREST_INT));
}

static void write_row(const struct vkb_host_ghosts *work, uint32_t y)
{
    const float border = work->params->radius;
    struct ghost_row rows[MAX_GHOSTS];
    uint32_t count = 0;
    uint16_t *to = (uint16_t *)(work->target.pixels + y * work->target.pitch);

    for (int i = 0; i < work->params->count; ++i)
        count += find_row(work, (uint32_t)i, y, &rows[count]);
    for (uint32_t x = 0; x < work->target.width; ++x) {
        pixel sum = {0.0f};
        for (uint32_t i = 0; i < count; ++i) {
            const struct ghost_row *row = &rows[i];
            const struct vkb_ghost_column *column = &row->columns[x];
            const float left = 1.0f - sqrtf(column->share + row->share) / border;
            if (!(left > 0.0f))
                continue;
            const __m256 weights =
                _mm256_set_m128(_mm_set1_ps(column->right), _mm_set1_ps(column->left));
            const pixel upper = sample_row(row->upper + (size_t)4 * column->texel, weights);
            const pixel lower = sample_row(row->lower + (size_t)4 * column->texel, weights);
            sum += left * row->tint * (row->above * upper + row->below * lower);
        }
        if (work->before.pixels)
            sum = halves_to_pixel(halves_at(&work->before, y) + (size_t)4 * x) + sum;
        if (!work->blurs_alpha)
            sum[3] = 1.0f;
        store_halves(sum, to + (size_t)4 * x);
    }
}

static void ghosts(void *context, uint32_t part, uint32_t first, uint32_t end)
{
    (void)part;
    for (uint32_t y = first; y < end; ++y)
        write_row(context, y);
}
