#include "vulkan/format.h"

#include "shaders/params.h"

#include <float.h>
#include <string.h>

#define COLOUR VK_IMAGE_ASPECT_COLOR_BIT

const struct vkb_format_info vkb_formats[VKB_FORMAT_COUNT] = {
    // Also of the textures of custom methods, which have formats of their own.
    [VKB_FORMAT_NONE] = {.name = "none", .dtype = "none", .aspect = COLOUR},
#define FORMAT_ROW(argument, format, texels, stored, ...) \
    [VKB_FORMAT_##format] = {.channels = 4, .aspect = COLOUR, __VA_ARGS__},
    VKB_BUFFER_FORMATS(FORMAT_ROW, )
#undef FORMAT_ROW
        [VKB_FORMAT_R32_FLOAT] = {"r32float", "float32", VK_FORMAT_R32_SFLOAT, 1, 4, COLOUR,
                                  .limit = FLT_MAX},
    [VKB_FORMAT_RG32_FLOAT] = {"rg32float", "float32", VK_FORMAT_R32G32_SFLOAT, 2, 4, COLOUR,
                               .limit = FLT_MAX},
    [VKB_FORMAT_DEPTH32_FLOAT] = {"depth32float", "float32", VK_FORMAT_D32_SFLOAT, 1, 4,
                                  VK_IMAGE_ASPECT_DEPTH_BIT},
};
