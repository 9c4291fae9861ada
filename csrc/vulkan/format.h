// The image formats of the package: WebGPU names, Vulkan formats, bytes and NumPy dtypes.
#ifndef VKB_FORMAT_H
#define VKB_FORMAT_H

#include <stdbool.h>
#include <stdint.h>
#include <vulkan/vulkan_core.h>

// The formats of bloom buffers: FORMAT(argument, name in C, the texels that hold it and for which
// shaders are compiled, how shaders round to it (lib/storage.glsl), members of its row).
//
// Few devices draw into R11G11B10 and store to it, and they may cut bits off; none stores to sRGB:
// the shaders round, and single floats hold what they rounded to. The largest float of 11 bits is
// 65024; that of 10 bits is less.
#define VKB_BUFFER_FORMATS(FORMAT, argument) \
    FORMAT(argument, RGBA8_UNORM, rgba8unorm, STORED_UNORM8, .name = "rgba8unorm", \
           .dtype = "uint8", .vk = VK_FORMAT_R8G8B8A8_UNORM, .channel_size = 1, .limit = 1.0f) \
    FORMAT(argument, RGBA16_FLOAT, rgba16float, STORED_HALF, .name = "rgba16float", \
           .dtype = "float16", .vk = VK_FORMAT_R16G16B16A16_SFLOAT, .channel_size = 2, \
           .limit = (float)HALF_LIMIT) \
    FORMAT(argument, RGBA32_FLOAT, rgba32float, STORED_SINGLE, .name = "rgba32float", \
           VKB_SINGLE_TEXELS, .limit = FLT_MAX) \
    FORMAT(argument, RG11B10_UFLOAT, rgba32float, STORED_UFLOAT, .name = "rg11b10ufloat", \
           VKB_SINGLE_TEXELS, .rounded = true, .has_no_alpha = true, .limit = 65024.0f) \
    FORMAT(argument, RGBA8_SRGB, rgba32float, STORED_SRGB8, .name = "rgba8unorm-srgb", \
           VKB_SINGLE_TEXELS, .rounded = true, .of_frames = true, .limit = 1.0f)
#define VKB_SINGLE_TEXELS .dtype = "float32", .vk = VK_FORMAT_R32G32B32A32_SFLOAT, .channel_size = 4

enum vkb_format {
    VKB_FORMAT_NONE,  // also: the default of a setting
#define VKB_FORMAT_ENUM(argument, format, texels, stored, ...) VKB_FORMAT_##format,
    VKB_BUFFER_FORMATS(VKB_FORMAT_ENUM, )
#undef VKB_FORMAT_ENUM
        VKB_FORMAT_R32_FLOAT,  // of masks
    VKB_FORMAT_RG32_FLOAT,     // of spectra in complete lines
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
    float limit;        // the largest value that it holds, or an upper bound
    bool rounded;       // the shaders round to it, and single floats hold what they rounded to
    bool has_no_alpha;  // alpha cannot be blurred in it
    bool of_frames;  // also of the first image of a published method, which others have unrounded
};

extern const struct vkb_format_info vkb_formats[VKB_FORMAT_COUNT];

static inline uint32_t vkb_pixel_size(enum vkb_format format)
{
    return vkb_formats[format].channels * vkb_formats[format].channel_size;
}

// Whether sums of levels are stored as means. (The one engine with sRGB stores the sums, up to 1.)
static inline bool vkb_stores_means(enum vkb_format format)
{
    return vkb_formats[format].limit == 1.0f && !vkb_formats[format].rounded;
}

#endif
