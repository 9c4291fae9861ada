#include "vulkan/format.h"

#include "shaders/params.h"

#include <float.h>
#include <string.h>

#define COLOUR VK_IMAGE_ASPECT_COLOR_BIT

const struct vkb_format_info vkb_formats[VKB_FORMAT_COUNT] = {
    // Also of the textures of custom methods, which have formats of their own.
    [VKB_FORMAT_NONE] = {.name = "none", .dtype = "none", .aspect = COLOUR},
    [VKB_FORMAT_RGBA8_UNORM] = {"rgba8unorm", "uint8", VK_FORMAT_R8G8B8A8_UNORM, 4, 1, COLOUR,
                                1.0f},
    [VKB_FORMAT_RGBA16_FLOAT] = {"rgba16float", "float16", VK_FORMAT_R16G16B16A16_SFLOAT, 4, 2,
                                 COLOUR, (float)HALF_LIMIT},
    [VKB_FORMAT_RGBA32_FLOAT] = {"rgba32float", "float32", VK_FORMAT_R32G32B32A32_SFLOAT, 4, 4,
                                 COLOUR, FLT_MAX},
    // Few devices draw into R11G11B10 and store to it, and they may cut bits off; none stores to
    // sRGB: the shaders round, and single floats hold what they rounded to. The largest float of 11
    // bits is 65024; that of 10 bits is less.
    [VKB_FORMAT_RG11B10_UFLOAT] = {"rg11b10ufloat", "float32", VK_FORMAT_R32G32B32A32_SFLOAT, 4, 4,
                                   COLOUR, 65024.0f},
    [VKB_FORMAT_RGBA8_SRGB] = {"rgba8unorm-srgb", "float32", VK_FORMAT_R32G32B32A32_SFLOAT, 4, 4,
                               COLOUR, 1.0f},
    [VKB_FORMAT_R32_FLOAT] = {"r32float", "float32", VK_FORMAT_R32_SFLOAT, 1, 4, COLOUR, FLT_MAX},
    [VKB_FORMAT_DEPTH32_FLOAT] = {"depth32float", "float32", VK_FORMAT_D32_SFLOAT, 1, 4,
                                  VK_IMAGE_ASPECT_DEPTH_BIT, 0.0f},
};
