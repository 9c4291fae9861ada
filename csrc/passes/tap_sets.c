#include "passes/tap_sets.h"

#include <math.h>
#include <string.h>

struct tap_numbers {
    int x, y;
};

// A kernel of four taps: upper left, upper right, lower left, lower right.
struct four {
    double share;
    int taps[4];
};

struct tap_set {
    struct tap_numbers taps[MAX_SET_TAPS];
    uint32_t tap_count;
    struct four fours[MAX_SET_KERNELS];
    uint32_t four_count;
};

#define TAP_NUMBERS(number, x, y)             [number] = {x, y},
#define COUNT_TAP(number, x, y)               +1
#define FOUR_TAPS(number, share, a, b, c, d)  [number] = {share, {a, b, c, d}},
#define COUNT_FOUR(number, share, a, b, c, d) +1
#define TAP_SET(name, value, ROWS, KERNELS, PLACE, SHARE) \
    [name] = {{ROWS(TAP_NUMBERS)}, 0 ROWS(COUNT_TAP), {KERNELS(FOUR_TAPS)}, 0 KERNELS(COUNT_FOUR)},

static const struct tap_set tap_sets[] = {TAP_SETS(TAP_SET)};

// Each number is of one set. Without kernels each tap is one, of which a shader has room for few.
#define CHECK_KERNELS(name, value, ROWS, KERNELS, PLACE, SHARE) \
    _Static_assert((0 KERNELS(COUNT_FOUR) ? 0 KERNELS(COUNT_FOUR) : 0 ROWS(COUNT_TAP)) \
                       <= MAX_SET_KERNELS, \
                   #name " has more than MAX_SET_KERNELS kernels");
TAP_SETS(CHECK_KERNELS)
#define SET_NUMBER(name, value, ROWS, KERNELS, PLACE, SHARE) +(1ull << (value))
#define LINE_NUMBER(name, value, half_kernel)                +(1ull << (value))
#define SET_BIT(name, value, ROWS, KERNELS, PLACE, SHARE)    | (1ull << (value))
#define LINE_BIT(name, value, half_kernel)                   | (1ull << (value))
_Static_assert((0 TAP_SETS(SET_NUMBER) LINE_SETS(LINE_NUMBER))
                   == (0 TAP_SETS(SET_BIT) LINE_SETS(LINE_BIT)),
               "two sets of taps have the same number");

#define PLACE_CASE(name, value, ROWS, KERNELS, PLACE, SHARE) \
    case name: \
        return PLACE(at, part);

static double place_of(int32_t set, int at, double part)
{
    switch (set) {
        TAP_SETS(PLACE_CASE)
    default:
        return 0.0 * part;
    }
}

#define IS_LINE(name, value, half_kernel) || set == name

bool vkb_is_line_set(int32_t set)
{
    return false LINE_SETS(IS_LINE);
}

uint32_t vkb_count_taps(int32_t set)
{
    return tap_sets[set].tap_count;
}

uint32_t vkb_count_kernels(int32_t set)
{
    return tap_sets[set].four_count ? tap_sets[set].four_count : tap_sets[set].tap_count;
}

int32_t vkb_find_window(int32_t set)
{
    double furthest = 0.0;

    for (uint32_t tap = 0; tap < tap_sets[set].tap_count; ++tap) {
        const struct tap_numbers at = tap_sets[set].taps[tap];
        furthest = fmax(furthest, fabs(place_of(set, at.x, 0.0)));
        furthest = fmax(furthest, fabs(place_of(set, at.y, 0.0)));
    }
    return 2 * (int32_t)ceil(furthest) + 2;
}

bool vkb_has_texel_places(int32_t set)
{
    return place_of(set, 1, 0.25) == 1.0;
}

bool vkb_moves_texels(int32_t set)
{
    const double end = 0.999;
    bool moves = false;

    for (int at = -MAX_PLACE; at <= MAX_PLACE; ++at)
        moves = moves || floor(place_of(set, at, 0.0)) != floor(place_of(set, at, end) + end);
    return moves;
}

// Makes an axis one of a tap, or of two with equal weights.
static void set_taps(struct vkb_axis *axis, int32_t set, int first, int last, double step)
{
    const double weight = first == last ? 1.0 : 0.5;
    const struct vkb_tap taps[] = {
        {.offset = place_of(set, first, 0.0) * step, .weights = {weight}},
        {.offset = place_of(set, last, 0.0) * step, .weights = {weight}},
    };

    vkb_axis_set(axis, taps, first == last ? 1 : 2);
    // The place of such a tap depends on the position.
    if (set == TAPS_PAIRS) {
        axis->taps[0].offset = 0.0;
        axis->kind = first < 0 ? UPSAMPLE_LEFT_PAIR : UPSAMPLE_RIGHT_PAIR;
    }
}

void vkb_filter_tap(struct vkb_filter *filter, int32_t set, uint32_t tap, double step_x,
                    double step_y)
{
    const struct tap_numbers at = tap_sets[set].taps[tap];

    set_taps(&filter->x, set, at.x, at.x, step_x);
    set_taps(&filter->y, set, at.y, at.y, step_y);
}

void vkb_filter_kernel(struct vkb_filter *filter, int32_t set, uint32_t kernel, double step_x,
                       double step_y)
{
    if (!tap_sets[set].four_count) {
        vkb_filter_tap(filter, set, kernel, step_x, step_y);
        return;
    }
    const struct four *four = &tap_sets[set].fours[kernel];
    const struct tap_numbers *first = &tap_sets[set].taps[four->taps[0]];
    const struct tap_numbers *last = &tap_sets[set].taps[four->taps[3]];
    set_taps(&filter->x, set, first->x, last->x, step_x);
    set_taps(&filter->y, set, first->y, last->y, step_y);
}

// Taps along an axis, and a kernel of them along both.
struct line {
    uint32_t count;
    struct {
        double at, weight;
    } taps[2 * MAX_PLACE + 1];
};

struct product {
    struct line x, y;
};

static void add_tap(struct line *line, double at, double weight)
{
    uint32_t place = 0;

    while (place < line->count && line->taps[place].at != at)
        ++place;
    line->count += place == line->count;
    line->taps[place].at = at;
    line->taps[place].weight += weight;
}

static struct line line_of(int32_t set, int first, int last, double share)
{
    struct line line = {0};

    add_tap(&line, place_of(set, first, 0.0), 0.5 * share);
    add_tap(&line, place_of(set, last, 0.0), 0.5 * share);
    return line;
}

static struct product product_of(int32_t set, uint32_t kernel, double share)
{
    const struct tap_set *taps = &tap_sets[set];
    const struct tap_numbers *first = &taps->taps[kernel], *last = first;

    if (taps->four_count) {
        first = &taps->taps[taps->fours[kernel].taps[0]];
        last = &taps->taps[taps->fours[kernel].taps[3]];
    }
    return (struct product){line_of(set, first->x, last->x, share),
                            line_of(set, first->y, last->y, 1.0)};
}

static bool are_same(const struct line *a, const struct line *b)
{
    bool same = a->count == b->count;

    for (uint32_t i = 0; same && i < a->count; ++i)
        same = a->taps[i].at == b->taps[i].at && a->taps[i].weight == b->taps[i].weight;
    return same;
}

static void add_line(struct line *to, const struct line *from)
{
    for (uint32_t i = 0; i < from->count; ++i)
        add_tap(to, from->taps[i].at, from->taps[i].weight);
}

// Makes one of two kernels with the same taps along y, or along x. Returns how many are left.
static uint32_t merge(struct product *products, uint32_t count, bool along_x)
{
    for (uint32_t i = 0; i < count; ++i)
        for (uint32_t j = i + 1; j < count;) {
            struct product *to = &products[i], *from = &products[j];
            if (!are_same(along_x ? &to->y : &to->x, along_x ? &from->y : &from->x)) {
                ++j;
                continue;
            }
            add_line(along_x ? &to->x : &to->y, along_x ? &from->x : &from->y);
            memmove(from, from + 1, (--count - j) * sizeof *from);
        }
    return count;
}

static void take_line(struct vkb_axis *axis, const struct line *line, uint32_t kernel, double step)
{
    for (uint32_t i = 0; i < line->count; ++i) {
        struct vkb_tap *tap = &axis->taps[axis->count++];
        *tap = (struct vkb_tap){.offset = line->taps[i].at * step};
        tap->weights[kernel] = line->taps[i].weight;
    }
}

// Whether a filter has space for the kernels and their taps.
static bool are_few(const struct product *products, uint32_t count)
{
    uint32_t taps_x = 0, taps_y = 0;

    for (uint32_t i = 0; i < count; ++i) {
        taps_x += products[i].x.count;
        taps_y += products[i].y.count;
    }
    return count <= MAX_KERNELS && taps_x <= VKB_MAX_TAPS && taps_y <= VKB_MAX_TAPS;
}

bool vkb_filter_mean(struct vkb_filter *filter, int32_t set, double step_x, double step_y)
{
    static const struct line tent = {
        3, {{-1.0, PAIR_SIDE}, {0.0, 1.0 - 2.0 * PAIR_SIDE}, {1.0, PAIR_SIDE}}};
    const uint32_t kernels = vkb_count_kernels(set);
    struct product products[MAX_SET_KERNELS] = {{tent, tent}};
    uint32_t count = 1;

    if (set != TAPS_PAIRS) {
        for (uint32_t i = 0; i < kernels; ++i)
            products[i] = product_of(
                set, i, tap_sets[set].four_count ? tap_sets[set].fours[i].share : 1.0 / kernels);
        count = merge(products, merge(products, kernels, true), false);
    }
    if (!are_few(products, count))
        return false;
    filter->kernels = count;
    filter->x.count = filter->y.count = 0;
    filter->x.kind = filter->y.kind = UPSAMPLE_LINEAR;
    for (uint32_t i = 0; i < count; ++i) {
        take_line(&filter->x, &products[i].x, i, step_x);
        take_line(&filter->y, &products[i].y, i, step_y);
    }
    return true;
}
