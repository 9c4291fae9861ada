// A user shader on an image by libplacebo: apply_hook FILE WIDTH HEIGHT FRAMES [NAME=VALUE...].
// Reads the image from the standard input, RGBA floats; writes width and height of the last frame
// (two 32-bit integers) and its RGBA floats to the standard output. Every stage that an RGB picture
// reaches runs in the order of libplacebo's renderer, with nothing between them, on textures of
// single floats. Fails with libplacebo's messages if the file is invalid or a pass fails.
#include <libplacebo/dispatch.h>
#include <libplacebo/gpu.h>
#include <libplacebo/log.h>
#include <libplacebo/shaders/custom.h>
#include <libplacebo/vulkan.h>

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FORMAT_BITS = 32, CHANNELS = 4, MAX_TEXTURES = 4096, STAGES = 9 };

static const enum pl_hook_stage stages[STAGES] = {
    PL_HOOK_RGB_INPUT,   PL_HOOK_NATIVE, PL_HOOK_RGB,        PL_HOOK_LINEAR, PL_HOOK_PRE_KERNEL,
    PL_HOOK_POST_KERNEL, PL_HOOK_SCALED, PL_HOOK_PRE_OUTPUT, PL_HOOK_OUTPUT,
};

struct machine {
    pl_vulkan vulkan;
    pl_dispatch dispatch;
    pl_fmt format;
    // All textures live until the end.
    pl_tex textures[MAX_TEXTURES];
    int count;
};

static void fail(const char *what)
{
    fprintf(stderr, "%s\n", what);
    exit(1);
}

static pl_tex get_texture(void *priv, int width, int height)
{
    struct machine *machine = priv;
    if (machine->count == MAX_TEXTURES)
        return NULL;
    struct pl_tex_params params = {.w = width,
                                   .h = height,
                                   .format = machine->format,
                                   .sampleable = true,
                                   .renderable = true,
                                   .storable = true,
                                   .host_writable = true,
                                   .host_readable = true};
    pl_tex texture = pl_tex_create(machine->vulkan->gpu, &params);
    if (texture)
        machine->textures[machine->count++] = texture;
    return texture;
}

static char *read_file(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    if (!file || fseek(file, 0, SEEK_END))
        fail("the file cannot be read");
    *size = (size_t)ftell(file);
    rewind(file);
    char *text = malloc(*size + 1);
    if (!text || fread(text, 1, *size, file) != *size)
        fail("the file cannot be read");
    fclose(file);
    return text;
}

static void set_value(const struct pl_hook_par *parameter, const char *value)
{
    if (parameter->names) {
        for (int i = parameter->minimum.i; i <= parameter->maximum.i; i++) {
            if (!strcmp(parameter->names[i], value)) {
                parameter->data->i = i;
                return;
            }
        }
    }
    if (parameter->type == PL_VAR_FLOAT)
        parameter->data->f = strtof(value, NULL);
    else if (parameter->type == PL_VAR_UINT)
        parameter->data->u = (unsigned)strtoul(value, NULL, 10);
    else
        parameter->data->i = (int)strtol(value, NULL, 10);
}

static void set_parameter(const struct pl_hook *hook, const char *argument)
{
    const char *value = strchr(argument, '=');
    if (!value)
        fail("a parameter is not NAME=VALUE");
    size_t length = (size_t)(value - argument);
    for (int i = 0; i < hook->num_parameters; i++) {
        const char *name = hook->parameters[i].name;
        if (strlen(name) == length && !strncmp(name, argument, length)) {
            set_value(&hook->parameters[i], value + 1);
            return;
        }
    }
    fail("the file has no such parameter");
}

// The picture after one stage.
static pl_tex run_stage(struct machine *machine, const struct pl_hook *hook,
                        enum pl_hook_stage stage, pl_tex picture, pl_tex source)
{
    static const struct pl_color_repr repr = {.sys = PL_COLOR_SYSTEM_RGB,
                                              .levels = PL_COLOR_LEVELS_FULL,
                                              .alpha = PL_ALPHA_PREMULTIPLIED};
    static const struct pl_color_space color = {.primaries = PL_COLOR_PRIM_BT_709,
                                                .transfer = PL_COLOR_TRC_LINEAR};
    if (hook->input != PL_HOOK_SIG_TEX)
        fail("the hook does not take a texture");
    int width = picture->params.w, height = picture->params.h;
    struct pl_hook_params params = {
        .gpu = machine->vulkan->gpu,
        .dispatch = machine->dispatch,
        .get_tex = get_texture,
        .priv = machine,
        .stage = stage,
        .tex = picture,
        .rect = {0, 0, (float)width, (float)height},
        .repr = repr,
        .color = color,
        .components = CHANNELS,
        .orig_repr = &repr,
        .orig_color = &color,
        .src_rect = {0, 0, (float)source->params.w, (float)source->params.h},
        .dst_rect = {0, 0, source->params.w, source->params.h},
    };
    struct pl_hook_res result = hook->hook(hook->priv, &params);
    if (result.failed)
        fail("a pass failed");
    if (result.output == PL_HOOK_SIG_TEX)
        return result.tex;
    if (result.output == PL_HOOK_SIG_NONE)
        return picture;
    if (pl_hook_stage_resizable(stage)) {
        width = (int)(pl_rect_w(result.rect) + 0.5f);
        height = (int)(pl_rect_h(result.rect) + 0.5f);
    }
    pl_tex target = get_texture(machine, width, height);
    struct pl_dispatch_params last = {.shader = &result.sh, .target = target};
    if (!target || !pl_dispatch_finish(machine->dispatch, &last))
        fail("the last pass failed");
    return target;
}

static pl_tex run_frames(struct machine *machine, const struct pl_hook *hook, pl_tex source,
                         int frames)
{
    pl_tex picture = source;
    for (int frame = 0; frame < frames; frame++) {
        picture = source;
        if (hook->reset)
            hook->reset(hook->priv);
        for (int i = 0; i < STAGES; i++)
            if (hook->stages & stages[i])
                picture = run_stage(machine, hook, stages[i], picture, source);
        pl_dispatch_reset_frame(machine->dispatch);
    }
    return picture;
}

static pl_tex read_image(struct machine *machine, int width, int height)
{
    size_t size = (size_t)width * (size_t)height * CHANNELS;
    float *pixels = malloc(size * sizeof(float));
    pl_tex source = get_texture(machine, width, height);
    if (!pixels || !source || fread(pixels, sizeof(float), size, stdin) != size)
        fail("the image cannot be read");
    struct pl_tex_transfer_params transfer = {.tex = source, .ptr = pixels};
    if (!pl_tex_upload(machine->vulkan->gpu, &transfer))
        fail("the image cannot be uploaded");
    free(pixels);
    return source;
}

static void write_image(struct machine *machine, pl_tex picture)
{
    int32_t sides[2] = {picture->params.w, picture->params.h};
    size_t size = (size_t)sides[0] * (size_t)sides[1] * CHANNELS;
    float *pixels = malloc(size * sizeof(float));
    struct pl_tex_transfer_params transfer = {.tex = picture, .ptr = pixels};
    if (!pixels || !pl_tex_download(machine->vulkan->gpu, &transfer))
        fail("the result cannot be downloaded");
    if (fwrite(sides, sizeof(sides), 1, stdout) != 1
        || fwrite(pixels, sizeof(float), size, stdout) != size || fflush(stdout))
        fail("the result cannot be written");
    free(pixels);
}

int main(int argc, char **argv)
{
    if (argc < 5)
        fail("apply_hook FILE WIDTH HEIGHT FRAMES [NAME=VALUE...]");
    struct pl_log_params logging = {.log_cb = pl_log_simple, .log_level = PL_LOG_WARN};
    logging.log_priv = stderr;
    pl_log log = pl_log_create(PL_API_VER, &logging);
    struct pl_vulkan_params params = pl_vulkan_default_params;
    params.allow_software = true;
    struct machine machine = {.vulkan = pl_vulkan_create(log, &params)};
    if (!machine.vulkan)
        fail("no Vulkan device");
    pl_gpu gpu = machine.vulkan->gpu;
    machine.dispatch = pl_dispatch_create(log, gpu);
    machine.format = pl_find_fmt(gpu, PL_FMT_FLOAT, CHANNELS, FORMAT_BITS, FORMAT_BITS,
                                 PL_FMT_CAP_SAMPLEABLE | PL_FMT_CAP_LINEAR | PL_FMT_CAP_STORABLE
                                     | PL_FMT_CAP_RENDERABLE);
    if (!machine.format)
        fail("the device has no format of single floats");
    size_t size = 0;
    char *text = read_file(argv[1], &size);
    const struct pl_hook *hook = pl_mpv_user_shader_parse(gpu, text, size);
    if (!hook)
        fail("the file is invalid");
    for (int i = 5; i < argc; i++)
        set_parameter(hook, argv[i]);
    pl_tex source = read_image(&machine, atoi(argv[2]), atoi(argv[3]));
    write_image(&machine, run_frames(&machine, hook, source, atoi(argv[4])));

    pl_mpv_user_shader_destroy(&hook);
    for (int i = 0; i < machine.count; i++)
        pl_tex_destroy(gpu, &machine.textures[i]);
    pl_dispatch_destroy(&machine.dispatch);
    pl_vulkan_destroy(&machine.vulkan);
    pl_log_destroy(&log);
    free(text);
    return 0;
}
