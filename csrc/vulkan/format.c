#include "vulkan/format.h"

#include "shaders/params.h"

#include <float.h>
#include <string.h>

const struct vkb_format_info vkb_formats[VKB_FORMAT_COUNT] = {
    [VKB_FORMAT_NONE] = {.name = "none", .dtype = "none"},
    [VKB_FORMAT_RGBA8_UNORM] =
        {
            .name = "rgba8unorm",
            .dtype = "uint8",
            .vk = VK_FORMAT_R8G8B8A8_UNORM,
            .channels = 4,
            .channel_size = 1,
            .aspect = VK_IMAGE_ASPECT_COLOR_BIT,
            .limit = (float)UNORM_LIMIT,
        },
    [VKB_FORMAT_RGBA16_FLOAT] =
        {
            .name = "rgba16float",
            .dtype = "float16",
            .vk = VK_FORMAT_R16G16B16A16_SFLOAT,
            .channels = 4,
            .channel_size = 2,
            .aspect = VK_IMAGE_ASPECT_COLOR_BIT,
            .limit = (float)HALF_LIMIT,
        },
    [VKB_FORMAT_RGBA32_FLOAT] =
        {
            .name = "rgba32float",
            .dtype = "float32",
            .vk = VK_FORMAT_R32G32B32A32_SFLOAT,
            .channels = 4,
            .channel_size = 4,
            .aspect = VK_IMAGE_ASPECT_COLOR_BIT,
            .limit = FLT_MAX,
        },
    // Few devices draw into R11G11B10 and store to it, and they may cut bits off; none stores to
    // sRGB: the shaders round, and single floats hold what they rounded to.
    [VKB_FORMAT_RG11B10_UFLOAT] =
        {
            .name = "rg11b10ufloat",
            .dtype = "float32",
            .vk = VK_FORMAT_R32G32B32A32_SFLOAT,
            .channels = 4,
            .channel_size = 4,
            .aspect = VK_IMAGE_ASPECT_COLOR_BIT,
            .limit = (float)UFLOAT11_LIMIT,
        },
    [VKB_FORMAT_RGBA8_SRGB] =
        {
            .name = "rgba8unorm-srgb",
            .dtype = "float32",
            .vk = VK_FORMAT_R32G32B32A32_SFLOAT,
            .channels = 4,
            .channel_size = 4,
            .aspect = VK_IMAGE_ASPECT_COLOR_BIT,
            .limit = (float)UNORM_LIMIT,
        },
    [VKB_FORMAT_R32_FLOAT] =
        {
            .name = "r32float",
            .dtype = "float32",
            .vk = VK_FORMAT_R32_SFLOAT,
            .channels = 1,
            .channel_size = 4,
            .aspect = VK_IMAGE_ASPECT_COLOR_BIT,
            .limit = FLT_MAX,
        },
    [VKB_FORMAT_DEPTH32_FLOAT] =
        {
            .name = "depth32float",
            .dtype = "float32",
            .vk = VK_FORMAT_D32_SFLOAT,
            .channels = 1,
            .channel_size = 4,
            .aspect = VK_IMAGE_ASPECT_DEPTH_BIT,
        },
};
