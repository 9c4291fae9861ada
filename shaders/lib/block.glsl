// Expands the rows of params.h into a uniform block and into named constants.
#include "params.h"

#define MEMBER_SETTING(block, name, initial, low, high) float name;
#define MEMBER_INPUT(block, type, name) type name;
#define MEMBER_VEC4S(block, name, count) vec4 name[count];
#define UNIFORM_BLOCK(ROWS) \
    layout(set = 0, binding = 0, std140) uniform Parameters { \
        ROWS(parameters, MEMBER_SETTING, MEMBER_INPUT, MEMBER_VEC4S) \
    } params

#define CONSTANT_NAME(name, value, spelling) const int name = value;
COMPOSITE_NAMES(CONSTANT_NAME)
TONEMAP_NAMES(CONSTANT_NAME)
ENCODING_NAMES(CONSTANT_NAME)
TEXEL_NAMES(CONSTANT_NAME)
MODE_NAMES(CONSTANT_NAME)
