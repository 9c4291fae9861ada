// Convolutions with a kernel, or with a field of kernels.
#include "methods/convolve.h"

#include "methods/field.h"
#include "methods/methods.h"

// The kernel as the host gives it.
static uint32_t add_kernel(struct vkb_levels *levels)
{
    struct vkb_image_row row = vkb_given_image("kernel", &levels->settings->kernel);

    row.channels = 3;
    row.framebuffer = !vkb_method_of(levels->settings)->sums_gaussians;
    return vkb_levels_add(levels, &row);
}

uint32_t vkb_convolve(struct vkb_levels *levels, const struct vkb_image_row *result)
{
    const struct vkb_convolution convolution =
        vkb_describe_convolution(levels->settings, levels->source->buffers);
    const struct vkb_convolving passes = {
        .levels = levels, .convolution = &convolution, .prefix = "", .suffix = ""};

    if (levels->settings->field.count)
        return vkb_convolve_field(&passes, result);
    return vkb_add_product(&passes, vkb_add_kernel_spectrum(&passes, add_kernel(levels)), result);
}

uint32_t vkb_add_convolution_method(struct vkb_levels *levels)
{
    const struct vkb_bloom_source *source = levels->source;
    const struct vkb_size size = source->buffers;
    const bool same = size.width == source->final.width && size.height == source->final.height;
    const struct vkb_image_row whole = {
        .name = "bloom", .format = source->format, .framebuffer = true};
    const struct vkb_image_row part = {.name = "convolved", .format = VKB_FORMAT_RGBA32_FLOAT};
    const uint32_t convolved = vkb_convolve(levels, same ? &whole : &part);

    return same ? convolved : vkb_levels_enlarge(levels, UPSAMPLE_LINEAR, convolved, 1.0);
}
