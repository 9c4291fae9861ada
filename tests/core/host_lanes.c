// Transforms a picture by the loops for 4 and for 8 floats (csrc/passes/host_lanes.h), forth along
// rows, along columns with a product, and back, makes its sun beams, and transforms it as a kernel
// along rows. Prints the first step whose bits differ, or "same".
#include "passes/host_beams.h"
#include "passes/host_fft.h"
#include "passes/host_loops.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 23, HEIGHT = 13, ROW = 30, COLUMN = 20, HALF = ROW / 2 + 1, PITCH = 8 * HALF };

static float source[HEIGHT][4 * WIDTH], kernel[COLUMN][PITCH], weights[HEIGHT][4 * WIDTH];
static float results[2][3][COLUMN][PITCH];

static void run(const struct vkb_host_loops *loops, uint32_t channels,
                float result[3][COLUMN][PITCH])
{
    struct vkb_host_lines work = {
        .half = HALF, .channels = channels, .kept = WIDTH, .kernel_sign = -1.0f, .cleans = true};
    struct vkb_host_image rows = {result[0][0], PITCH, 2 * HALF, HEIGHT};
    struct vkb_host_image columns = {result[1][0], PITCH, 2 * HALF, HEIGHT};
    struct vkb_error error;
    static char space[4 * ROW * 8 * sizeof(float)] __attribute__((aligned(64)));
    int32_t places[ROW];

    for (int32_t i = 0; i < ROW; ++i)
        places[i] = i < WIDTH ? i : -1;
    work.places = places;
    work.space = space;
    work.source = (struct vkb_host_image){source[0], 4 * WIDTH, WIDTH, HEIGHT};
    work.weights = (struct vkb_host_image){weights[0], 4 * WIDTH, WIDTH, HEIGHT};
    work.target = rows;
    if (!vkb_host_line_create(ROW, &work.line, &error))
        exit(1);
    loops->rows_forth(&work, 0, 0, (HEIGHT + 3) / 4);
    vkb_host_line_destroy(&work.line);
    if (!vkb_host_line_create(COLUMN, &work.line, &error))
        exit(1);
    for (int32_t i = 0; i < COLUMN; ++i)
        places[i] = i < HEIGHT ? i : 0;
    work.source = rows;
    work.target = columns;
    work.weights.pixels = NULL;
    work.kernel = (struct vkb_host_image){kernel[0], PITCH, 2 * HALF, COLUMN};
    work.forth = work.back = true;
    work.kept = HEIGHT;
    loops->columns(&work, 0, 0, (HALF + loops->lanes - 1) / loops->lanes * channels);
    vkb_host_line_destroy(&work.line);
    if (!vkb_host_line_create(ROW, &work.line, &error))
        exit(1);
    work.source = columns;
    work.target = (struct vkb_host_image){result[2][0], PITCH, WIDTH, HEIGHT};
    work.weights.pixels = weights[0];
    work.kept = WIDTH;
    work.stores = true;
    loops->rows_back(&work, 0, 0, (HEIGHT + 3) / 4);
    vkb_host_line_destroy(&work.line);
}

// Of the columns' image, with some dark blocks.
static void run_beams(const struct vkb_host_loops *loops, bool jittered, float *result)
{
    static const struct vkb_sun_beams_params params = {
        .most = 20, .sun_x = 0.3f, .sun_y = 1.4f, .left = 0.7f};
    static const float dark[] = {-1.0f, -1.0f, -1.0f, 0.5f, -1.0f, -1.0f, -1.0f, -1.0f};
    const uint32_t width = PITCH / 4 - 2, height = COLUMN - 2;
    struct vkb_host_beams work = {
        .params = &params,
        .jittered = jittered,
        .blurs_alpha = true,
        .source = {kernel[0], PITCH, PITCH / 4, COLUMN},
        .dark = {jittered ? NULL : (float *)dark, sizeof dark / sizeof *dark, 2, 1},
        .target = {result, (size_t)4 * width, width, height},
    };

    loops->beams(&work, 0, 0, (width + VKB_BEAM_TILE - 1) / VKB_BEAM_TILE);
}

// The picture as a kernel of that many channels, with places that are empty, or where several are
// added up.
static void run_kernel(const struct vkb_host_loops *loops, uint32_t channels, float *result)
{
    static char space[6 * ROW * 8 * sizeof(float)] __attribute__((aligned(64)));
    struct vkb_kernel_places x[ROW], y[COLUMN];
    struct vkb_error error;
    struct vkb_host_lines work = {
        .half = HALF,
        .channels = channels,
        .source = {source[0], 4 * WIDTH, WIDTH, HEIGHT},
        .target = {result, PITCH, channels == 1 ? vkb_host_grey_width(HALF) : 2 * HALF, COLUMN},
        .kernel_x = x,
        .kernel_y = y,
        .gain = 0.3f,
        .space = space,
    };

    for (int32_t i = 0; i < ROW; ++i)
        x[i] = i == 3    ? (struct vkb_kernel_places){1, 21, 5}
             : i < WIDTH ? (struct vkb_kernel_places){i, i, 1}
                         : (struct vkb_kernel_places){0, -1, 1};
    for (int32_t i = 0; i < COLUMN; ++i)
        y[i] = i == 2 ? (struct vkb_kernel_places){0, 12, 3}
             : i >= 9 ? (struct vkb_kernel_places){i - 8, i - 8, 1}
                      : (struct vkb_kernel_places){0, -1, 1};
    if (!vkb_host_line_create(ROW, &work.line, &error))
        exit(1);
    loops->kernel_rows(&work, 0, 0, (COLUMN + 2 * loops->lanes - 1) / (2 * loops->lanes));
    vkb_host_line_destroy(&work.line);
}

static void fill(float *values, size_t count)
{
    for (size_t i = 0; i < count; ++i)
        values[i] = (float)rand() / (float)RAND_MAX;
}

int main(void)
{
#if defined __x86_64__
    static const char *const steps[] = {"rows forth", "columns", "rows back"};
    fill(source[0], sizeof source / sizeof(float));
    fill(weights[0], sizeof weights / sizeof(float));
    fill(kernel[0], sizeof kernel / sizeof(float));
    for (uint32_t channels = 3; __builtin_cpu_supports("avx2") && channels <= 4; ++channels) {
        memset(results, 0, sizeof results);
        run(&vkb_host_loops_4, channels, results[0]);
        run(&vkb_host_loops_8, channels, results[1]);
        static float beams[2][COLUMN * PITCH];
        run_beams(&vkb_host_loops_4, channels == 4, beams[0]);
        run_beams(&vkb_host_loops_8, channels == 4, beams[1]);
        if (memcmp(beams[0], beams[1], sizeof beams[0]) != 0 || beams[0][3] == 0.0f) {
            puts("beams");
            return 0;
        }
        static float kernels[2][COLUMN * PITCH];
        memset(kernels, 0, sizeof kernels);
        run_kernel(&vkb_host_loops_4, channels == 4 ? 4 : 1, kernels[0]);
        run_kernel(&vkb_host_loops_8, channels == 4 ? 4 : 1, kernels[1]);
        if (memcmp(kernels[0], kernels[1], sizeof kernels[0]) != 0
            || kernels[0][2 * PITCH] == 0.0f) {
            puts("kernel");
            return 0;
        }
        for (int step = 0; step < 3; ++step)
            if (memcmp(results[0][step], results[1][step], sizeof results[0][step]) != 0) {
                printf("%s, %u channels\n", steps[step], channels);
                return 0;
            }
    }
#endif
    puts("same");
    return 0;
}
