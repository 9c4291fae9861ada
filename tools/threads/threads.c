// Threads that render, read and close in random order, over the core without Python, so that
// ThreadSanitizer sees all of it. `threads SECONDS`: each thread has a renderer of its own and
// shares others, as renderer.c and batch.c do it: one lock a renderer around all that touches its
// device, and one mutex in place of the GIL around what those keep under it. Every picture is
// compared with one that was made before by one thread alone.
#include "methods/methods.h"
#include "run/frame.h"
#include "run/pages.h"
#include "variants/variants.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { THREADS = 8, SHARED = 3, SETTINGS = 5, SIZES = 3, SOURCES = 3, POINTS = 3, FLOATS = 4 };

enum source { SOURCE_IMAGE, SOURCE_FORWARD, SOURCE_DEFERRED };

// The last one's pictures are large enough to be written by the device itself.
static const struct vkb_size sizes[SIZES] = {{24, 16}, {17, 31}, {300, 301}};

struct picture {
    unsigned char *bytes;
    size_t size;
};

static struct vkb_settings settings_table[SETTINGS];
static float *noise[SIZES];
static struct vkb_scene_data scene_data;
static struct picture right[SOURCES][SETTINGS][SIZES];
static pthread_mutex_t gil = PTHREAD_MUTEX_INITIALIZER;
static atomic_bool over;

struct job;

// renderer.c's, with the same rules for the lock and the GIL.
struct renderer {
    pthread_mutex_t lock;
    unsigned references;  // with the GIL
    atomic_bool open;
    enum vkb_variants variants;
    struct vkb_device device;
    struct vkb_frame frame;
    struct vkb_pages *pages;
    struct job *abandoned;  // with the GIL
    size_t pipelines;       // with the GIL
};

// Requests that go to the device together.
struct job {
    struct renderer *renderer;
    enum source source;
    unsigned size, count;
    unsigned settings[POINTS];
    struct vkb_plan plans[POINTS];
    struct vkb_request requests[POINTS];
    struct vkb_pages *pages;  // that the arrays are in; NULL: they are plain
    struct vkb_submission *submission;
    struct job *next;
};

struct worker {
    unsigned number;
    struct renderer **cache;  // its own one, then the shared ones
    unsigned seed;
    unsigned long frames, closed, left, pipelines;
};

static struct renderer *renderers[THREADS + SHARED];  // with the GIL

static void die(const char *what, const struct vkb_error *error)
{
    fprintf(stderr, "%s: %s\n", what, error ? error->message : "");
    exit(1);
}

// Renderers

static bool interrupted(void *context)
{
    (void)context;
    pthread_mutex_lock(&gil);
    pthread_mutex_unlock(&gil);
    return false;
}

static struct renderer *open_renderer(void)
{
    struct vkb_error error = {0};
    struct renderer *renderer = vkb_alloc(&error, 1, sizeof *renderer);

    if (!renderer || !(renderer->pages = vkb_pages_create(&renderer->device, &error))
        || !vkb_device_create(&renderer->device, "software", "", false, &error)
        || !vkb_frame_create(&renderer->device, NULL, 0, &renderer->frame, &error)
        || !vkb_variants_by_name("auto", &renderer->device, &renderer->variants, &error))
        die("open", &error);
    pthread_mutex_init(&renderer->lock, NULL);
    renderer->device.interrupted = interrupted;
    renderer->device.frame_seconds = 300.0;
    renderer->references = 1;
    renderer->open = true;
    return renderer;
}

// With the GIL.
static void release_renderer(struct renderer *renderer)
{
    if (--renderer->references > 0)
        return;
    pthread_mutex_destroy(&renderer->lock);
    vkb_free(renderer);
}

// With the GIL; the device is done with it.
static void release_job(struct job *job)
{
    for (unsigned i = 0; i < job->count; ++i) {
        struct vkb_output *output = job->requests[i].outputs;
        if (job->pages)
            vkb_pages_give_back(job->pages, output->pages);
        else
            vkb_free(output->memory);
        vkb_free(output);
        vkb_free(job->requests[i].timings);
        vkb_plan_destroy(&job->plans[i]);
    }
    release_renderer(job->renderer);
    vkb_free(job);
}

// With the lock and the GIL.
static void release_abandoned(struct renderer *renderer)
{
    struct job **link = &renderer->abandoned;

    while (*link) {
        struct job *job = *link;
        if (renderer->open
            && !vkb_frame_drop(&renderer->device, &renderer->frame, job->submission)) {
            link = &job->next;
            continue;
        }
        *link = job->next;
        release_job(job);
    }
}

static void enter(struct renderer *renderer)
{
    pthread_mutex_lock(&renderer->lock);
    pthread_mutex_lock(&gil);
    release_abandoned(renderer);
    pthread_mutex_unlock(&gil);
}

static void leave(struct renderer *renderer)
{
    pthread_mutex_lock(&gil);
    renderer->pipelines = renderer->frame.pipelines.entry_count;
    pthread_mutex_unlock(&gil);
    pthread_mutex_unlock(&renderer->lock);
}

static void close_renderer(struct renderer *renderer)
{
    struct vkb_error error = {0};

    enter(renderer);
    if (renderer->open) {
        if (!vkb_frame_end(&renderer->device, &renderer->frame, &error))
            die("close", &error);
        renderer->open = false;
        vkb_frame_destroy(&renderer->device, &renderer->frame);
        pthread_mutex_lock(&gil);
        vkb_pages_close(renderer->pages);
        renderer->pages = NULL;
        pthread_mutex_unlock(&gil);
        vkb_device_destroy(&renderer->device);
        pthread_mutex_lock(&gil);
        release_abandoned(renderer);
        pthread_mutex_unlock(&gil);
    }
    leave(renderer);
}

// Jobs

static bool build_graph(const struct job *job, const struct vkb_settings *settings,
                        struct vkb_graph *graph, struct vkb_error *error)
{
    const struct vkb_image_source image = {
        .format = VKB_FORMAT_RGBA32_FLOAT,
        .size = sizes[job->size],
        .channels = FLOATS,
    };
    const struct vkb_scene_source scene = {
        .camera = {.position = {0, 0, 3}, .fov = 45, .near = 0.1, .far = 10},
        .size = sizes[job->size],
        .glow_intensity = 1.0,
        .has_glow = true,
    };
    const bool built = job->source == SOURCE_IMAGE ? vkb_build_image(settings, &image, graph, error)
                     : job->source == SOURCE_FORWARD
                         ? vkb_build_forward(settings, &scene, graph, error)
                         : vkb_build_deferred(settings, &scene, graph, error);

    return built
        && vkb_variants_choose(job->renderer->variants, &job->renderer->device, graph, error)
        && vkb_graph_check(graph, job->renderer->device.max_side, error);
}

// The final picture of a point, in the renderer's pages where it is large. With the GIL.
static void *array_of(struct job *job, size_t size, struct vkb_page_run **pages)
{
    struct vkb_error error;

    *pages = NULL;
    if (sizes[job->size].width < 256 || !job->renderer->pages)
        return vkb_alloc(&error, 1, size);
    job->pages = job->renderer->pages;
    *pages = vkb_pages_take(job->pages, size, &error);
    return *pages ? (*pages)->memory : NULL;
}

static void add_request(struct job *job, unsigned settings)
{
    struct vkb_plan *plan = &job->plans[job->count];
    struct vkb_request *request = &job->requests[job->count];
    struct vkb_error error = {0};

    if (!build_graph(job, &settings_table[settings], &plan->graph, &error)
        || !(plan->outputs = vkb_alloc(&error, 1, sizeof *plan->outputs)))
        die("add", &error);
    // Requests of one job have the same images.
    if (job->count > 0 && !vkb_graph_same_images(&job->plans[0].graph, &plan->graph)) {
        vkb_plan_destroy(plan);
        *plan = (struct vkb_plan){0};
        return;
    }
    if (!(request->timings = vkb_alloc(&error, plan->graph.pass_count, sizeof *request->timings))
        || !(request->outputs = vkb_alloc(&error, 1, sizeof *request->outputs)))
        die("add", &error);
    plan->outputs[0] = vkb_graph_find(&plan->graph, "final");
    plan->output_count = 1;
    request->plan = plan;
    const struct vkb_image_row *row = &plan->graph.images[plan->outputs[0]];
    const size_t size = (size_t)row->width * row->height * vkb_pixel_size(row->format);
    request->outputs[0].channels = vkb_graph_channels(&plan->graph, plan->outputs[0]);
    request->outputs[0].row_count = row->height;
    pthread_mutex_lock(&gil);
    request->outputs[0].memory = array_of(job, size, &request->outputs[0].pages);
    pthread_mutex_unlock(&gil);
    if (!request->outputs[0].memory)
        die("add: no memory", NULL);
    job->settings[job->count++] = settings;
}

static struct job *new_job(struct renderer *renderer, enum source source, unsigned size)
{
    struct vkb_error error = {0};
    struct job *job = vkb_alloc(&error, 1, sizeof *job);

    if (!job)
        die("job", &error);
    *job = (struct job){.renderer = renderer, .source = source, .size = size};
    pthread_mutex_lock(&gil);
    ++renderer->references;
    pthread_mutex_unlock(&gil);
    return job;
}

// False: the renderer is closed.
static bool submit(struct job *job)
{
    struct renderer *renderer = job->renderer;
    const struct vkb_size size = sizes[job->size];
    const struct vkb_input input = {
        .memory = noise[job->size],
        .row_stride = (ptrdiff_t)(size.width * FLOATS * sizeof(float)),
        .pixel_stride = FLOATS * sizeof(float),
        .channel_stride = sizeof(float),
        .format = VKB_FORMAT_RGBA32_FLOAT,
        .width = size.width,
        .height = size.height,
        .channels = FLOATS,
    };
    const struct vkb_frame_source source = {
        .scene = job->source == SOURCE_IMAGE ? NULL : &scene_data,
        .inputs = {[VKB_INPUT_IMAGE] = job->source == SOURCE_IMAGE ? &input : NULL},
    };
    struct vkb_error error = {0};

    enter(renderer);
    const bool open = renderer->open;
    if (open
        && !vkb_frame_submit(&renderer->device, &renderer->frame, &source, job->requests,
                             job->count, NULL, &job->submission, &error))
        die("submit", &error);
    leave(renderer);
    return open;
}

// False: the renderer was closed in between.
static bool collect(struct job *job)
{
    struct renderer *renderer = job->renderer;
    struct vkb_error error = {0};
    bool finished;

    enter(renderer);
    const bool open = renderer->open;
    if (open
        && !vkb_frame_collect(&renderer->device, &renderer->frame, job->submission, &finished,
                              &error))
        die("collect", &error);
    leave(renderer);
    return open;
}

// Nobody wants it any more, and the device may be at work on it.
static void set_abandoned(struct job *job)
{
    pthread_mutex_lock(&gil);
    job->next = job->renderer->abandoned;
    job->renderer->abandoned = job;
    pthread_mutex_unlock(&gil);
    // As the next call would: a closed renderer has none.
    struct renderer *renderer = job->renderer;
    pthread_mutex_lock(&gil);
    ++renderer->references;
    pthread_mutex_unlock(&gil);
    enter(renderer);
    leave(renderer);
    pthread_mutex_lock(&gil);
    release_renderer(renderer);
    pthread_mutex_unlock(&gil);
}

static size_t picture_size(const struct job *job, unsigned request)
{
    const struct vkb_plan *plan = &job->plans[request];
    const struct vkb_image_row *row = &plan->graph.images[plan->outputs[0]];

    return (size_t)row->width * row->height * vkb_pixel_size(row->format);
}

static void compare(const struct job *job)
{
    for (unsigned i = 0; i < job->count; ++i) {
        const struct picture *expected = &right[job->source][job->settings[i]][job->size];
        const size_t size = picture_size(job, i);
        if (size != expected->size
            || memcmp(job->requests[i].outputs[0].memory, expected->bytes, size) != 0) {
            fprintf(stderr, "source %d, settings %u, size %u: another picture\n", (int)job->source,
                    job->settings[i], job->size);
            exit(1);
        }
    }
}

static void finish(struct job *job)
{
    pthread_mutex_lock(&gil);
    release_job(job);
    pthread_mutex_unlock(&gil);
}

// Threads

static unsigned draw(struct worker *worker, unsigned below)
{
    return (unsigned)rand_r(&worker->seed) % below;
}

static struct renderer *take_renderer(unsigned cached)
{
    pthread_mutex_lock(&gil);
    struct renderer *renderer = renderers[cached];
    ++renderer->references;
    pthread_mutex_unlock(&gil);
    return renderer;
}

static void replace_renderer(struct worker *worker, unsigned cached)
{
    struct renderer *fresh = open_renderer();

    pthread_mutex_lock(&gil);
    struct renderer *old = renderers[cached];
    renderers[cached] = fresh;
    pthread_mutex_unlock(&gil);
    close_renderer(old);
    pthread_mutex_lock(&gil);
    release_renderer(old);
    pthread_mutex_unlock(&gil);
    ++worker->closed;
}

static void render(struct worker *worker, struct renderer *renderer, unsigned depth)
{
    struct job *job = new_job(renderer, draw(worker, SOURCES), draw(worker, SIZES));
    const unsigned count = 1 + draw(worker, POINTS);
    const unsigned way = draw(worker, 4);

    // Without the lock, as batch.c.
    const bool usable = renderer->open && !renderer->device.lost;
    for (unsigned i = 0; i < count; ++i)
        add_request(job, draw(worker, SETTINGS));
    if (!usable || !submit(job)) {
        finish(job);
        return;
    }
    if (way == 0) {
        ++worker->left;
        set_abandoned(job);
        return;
    }
    // Others, and this thread, go on before it is read.
    if (way == 1 && depth < 2)
        render(worker, renderer, depth + 1);
    if (collect(job)) {
        compare(job);
        worker->frames += job->count;
        // As Python does after each call, whoever renders now.
        pthread_mutex_lock(&gil);
        worker->pipelines += renderer->pipelines;
        pthread_mutex_unlock(&gil);
    }
    finish(job);
}

static void *work(void *argument)
{
    struct worker *worker = argument;

    while (!atomic_load(&over)) {
        const unsigned cached =
            draw(worker, 3) == 0 ? worker->number : THREADS + draw(worker, SHARED);
        if (draw(worker, 16) == 0) {
            replace_renderer(worker, cached);
            continue;
        }
        struct renderer *renderer = take_renderer(cached);
        render(worker, renderer, 0);
        pthread_mutex_lock(&gil);
        release_renderer(renderer);
        pthread_mutex_unlock(&gil);
    }
    return NULL;
}

// What is rendered

static void fill_settings(void)
{
    static const enum vkb_method methods[SETTINGS] = {
        VKB_METHOD_SEPARABLE,   VKB_METHOD_SEPARABLE, VKB_METHOD_PYRAMID,
        VKB_METHOD_DUAL_KAWASE, VKB_METHOD_KINO,
    };
    static const float weights[] = {0.227027f, 0.1945946f, 0.1216216f, 0.054054f, 0.016216f};

    for (unsigned i = 0; i < SETTINGS; ++i) {
        struct vkb_settings *settings = &settings_table[i];
        settings->method = methods[i];
        for (size_t row = 0; row < vkb_value_row_count; ++row) {
            const struct vkb_value_row *value = &vkb_value_rows[row];
            char *place = (char *)&settings->values + value->offset;
            if (value->type == VKB_VALUE_FLOAT)
                *(float *)place = (float)value->initial;
            else if (value->type == VKB_VALUE_INT)
                *(int *)place = (int)value->initial;
            else
                *(double *)place = value->initial;
        }
        memcpy(settings->weights, weights, sizeof weights);
        settings->weight_count = sizeof weights / sizeof weights[0];
        settings->layers[0] = (struct vkb_layer){1.0f, 1.0f};
        settings->layer_count = 1;
    }
    settings_table[1].bloom_width = 9;
    settings_table[1].bloom_height = 5;
}

static void fill_sources(void)
{
    static const float vertices[] = {
        -1, -1, 0, 0, 0, 1, 1, 0.5f, 0.2f,  //
        1,  -1, 0, 0, 0, 1, 0, 0.9f, 0.3f,  //
        0,  1,  0, 0, 0, 1, 0, 0.4f, 1.0f,
    };
    static const uint32_t indices[] = {0, 1, 2};
    const struct vkb_mesh_data mesh = {
        .vertices = vertices, .indices = indices, .vertex_count = 3, .index_count = 3};
    unsigned seed = 7;

    scene_data = (struct vkb_scene_data){.serial = 1, .body = mesh, .glow = mesh};
    for (unsigned i = 0; i < SIZES; ++i) {
        const size_t count = (size_t)sizes[i].width * sizes[i].height * FLOATS;
        struct vkb_error error;
        noise[i] = vkb_alloc(&error, count, sizeof(float));
        if (!noise[i])
            die("noise", &error);
        for (size_t value = 0; value < count; ++value)
            noise[i][value] = (float)rand_r(&seed) / (float)RAND_MAX;
    }
}

static bool is_black(const struct picture *picture)
{
    for (size_t i = 1; i < picture->size; ++i)
        if (picture->bytes[i] != picture->bytes[0])
            return false;
    return true;
}

static void render_right(void)
{
    struct renderer *renderer = open_renderer();
    struct vkb_error error;

    for (unsigned source = 0; source < SOURCES; ++source)
        for (unsigned settings = 0; settings < SETTINGS; ++settings)
            for (unsigned size = 0; size < SIZES; ++size) {
                struct picture *picture = &right[source][settings][size];
                struct job *job = new_job(renderer, source, size);
                add_request(job, settings);
                if (!submit(job) || !collect(job))
                    die("closed", NULL);
                picture->size = picture_size(job, 0);
                picture->bytes = vkb_alloc(&error, 1, picture->size);
                if (!picture->bytes)
                    die("picture", &error);
                memcpy(picture->bytes, job->requests[0].outputs[0].memory, picture->size);
                if (is_black(picture))
                    die("a picture with nothing in it", NULL);
                finish(job);
            }
    close_renderer(renderer);
    release_renderer(renderer);
}

int main(int count, char **arguments)
{
    const struct timespec length = {count > 1 ? atol(arguments[1]) : 5, 0};
    pthread_t threads[THREADS];
    struct worker workers[THREADS] = {0};
    unsigned long frames = 0, closed = 0, left = 0;

    fill_settings();
    fill_sources();
    render_right();
    for (unsigned i = 0; i < THREADS + SHARED; ++i)
        renderers[i] = open_renderer();
    for (unsigned i = 0; i < THREADS; ++i) {
        workers[i].number = i;
        workers[i].seed = i + 1;
        pthread_create(&threads[i], NULL, work, &workers[i]);
    }
    nanosleep(&length, NULL);
    atomic_store(&over, true);
    for (unsigned i = 0; i < THREADS; ++i) {
        pthread_join(threads[i], NULL);
        frames += workers[i].frames;
        closed += workers[i].closed;
        left += workers[i].left;
    }
    for (unsigned i = 0; i < THREADS + SHARED; ++i) {
        close_renderer(renderers[i]);
        release_renderer(renderers[i]);
    }
    for (unsigned i = 0; i < SIZES; ++i)
        vkb_free(noise[i]);
    for (unsigned source = 0; source < SOURCES; ++source)
        for (unsigned settings = 0; settings < SETTINGS; ++settings)
            for (unsigned size = 0; size < SIZES; ++size)
                vkb_free(right[source][settings][size].bytes);
    printf("%d threads, %ld s: %lu frames read, all exact; %lu submissions left pending; %lu "
           "renderers closed\n",
           (int)THREADS, (long)length.tv_sec, frames, left, closed);
    return 0;
}
