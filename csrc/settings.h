// What the user asked for, in C: filled by renderer.c, read by methods.c.
#ifndef VKB_SETTINGS_H
#define VKB_SETTINGS_H

#include "format.h"
#include "params.h"

#include <stdbool.h>

enum vkb_method {
    VKB_METHOD_SEPARABLE,
    VKB_METHOD_PYRAMID,
    VKB_METHOD_DUAL_KAWASE,
    VKB_METHOD_BEVY,
    VKB_METHOD_KINO,
    VKB_METHOD_FILAMENT,
    VKB_METHOD_URP,
    VKB_METHOD_HDRP,
    VKB_METHOD_UNREAL,
    VKB_METHOD_COUNT,
};

struct vkb_layer {
    float scale, strength;
};

struct vkb_settings {
    enum vkb_method method;
    struct vkb_values values;  // the numbers, where vkb_value_rows puts them
    int choices[VKB_CHOICE_COUNT];
    bool thresholded;                    // else the threshold and the knee do not count
    uint32_t bloom_width, bloom_height;  // 0: by bloom_scale
    enum vkb_format format;              // VKB_FORMAT_NONE: by the source
    float weights[MAX_WEIGHTS];
    uint32_t weight_count;
    struct vkb_layer layers[MAX_LAYERS];
    uint32_t layer_count;
};

#endif
