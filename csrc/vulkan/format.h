// The image formats of the package: WebGPU names, Vulkan formats, bytes and NumPy dtypes.
#ifndef VKB_FORMAT_H
#define VKB_FORMAT_H

#include <stdbool.h>
#include <stdint.h>
#include <vulkan/vulkan_core.h>

enum vkb_format {
    VKB_FORMAT_NONE,  // also: the default of a setting
    VKB_FORMAT_RGBA8_UNORM,
    VKB_FORMAT_RGBA16_FLOAT,
    VKB_FORMAT_RGBA32_FLOAT,
    VKB_FORMAT_RG11B10_UFLOAT,
    VKB_FORMAT_RGBA8_SRGB,
    VKB_FORMAT_R32_FLOAT,  // of masks
    VKB_FORMAT_DEPTH32_FLOAT,
    VKB_FORMAT_COUNT,
};

// The longest side of an image, for which the integers in sampling.glsl fit 32 bits.
enum { VKB_MAX_SIDE = 32768 };

// Images of a CPU are also buffers of such words.
enum { VKB_WORD_SIZE = 16 };
// Variants store up to so many bytes at once, and rows begin at multiples of it.
enum { VKB_STORE_SIZE = 2 * VKB_WORD_SIZE };
#define VKB_WORD_FORMAT VK_FORMAT_R32G32B32A32_UINT

struct vkb_format_info {
    const char *name;   // "rgba8unorm"
    const char *dtype;  // "uint8"
    VkFormat vk;
    uint32_t channels;
    uint32_t channel_size;  // bytes
    VkImageAspectFlags aspect;
    float limit;  // the largest value that it holds, or an upper bound
};

extern const struct vkb_format_info vkb_formats[VKB_FORMAT_COUNT];

static inline uint32_t vkb_pixel_size(enum vkb_format format)
{
    return vkb_formats[format].channels * vkb_formats[format].channel_size;
}

// Whether sums of levels are stored as means. (The one engine with sRGB stores the sums, up to 1.)
static inline bool vkb_stores_means(enum vkb_format format)
{
    return format == VKB_FORMAT_RGBA8_UNORM;
}

// Whether the shaders round to this format, and images of single floats hold what they rounded to.
static inline bool vkb_is_rounded(enum vkb_format format)
{
    return format == VKB_FORMAT_RG11B10_UFLOAT || format == VKB_FORMAT_RGBA8_SRGB;
}

#endif
