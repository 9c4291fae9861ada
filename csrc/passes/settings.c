#include "passes/settings.h"

const struct vkb_method_row vkb_method_rows[VKB_METHOD_COUNT] = {
#define METHOD_ROW(constant, python_name, ...) \
    [VKB_METHOD_##constant] = {__VA_ARGS__, .name = #python_name},
    VKB_METHODS(METHOD_ROW)
#undef METHOD_ROW
};
