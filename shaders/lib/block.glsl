// What all shaders begin with (setup.py): the rows of params.h as a uniform block, specialization constants and
// named constants, and the functions for values that are read and stored, and for thresholds.
#include "params.h"
#include "lib/layers.glsl"

#define MEMBER_READS(block, name) float name;
#define MEMBER_INPUT(block, type, name) type name;
#define MEMBER_VEC4S(block, name, count) vec4 name[count];
#define UNIFORM_BLOCK(ROWS) \
    layout(set = 0, binding = 0, std140) uniform Parameters { \
        ROWS(parameters, MEMBER_READS, MEMBER_INPUT, MEMBER_VEC4S) \
    } params

// An image that the pass reads. Those are bound after the parameters.
#define BINDING_OF(slot) (1 + (slot))
#define SAMPLED_IMAGE(slot, name) layout(set = 0, binding = BINDING_OF(slot)) uniform sampler2D name

#define SLOT_CONSTANT(name, number) const int name = number;
SLOTS(SLOT_CONSTANT)

#define CONSTANT_NAME(name, value, spelling) const int name = value;
#define CHOICE_CONSTANTS(choice, NAMES) NAMES(CONSTANT_NAME)
CHOICES(CHOICE_CONSTANTS)
MODE_NAMES(CONSTANT_NAME)

#define SET_NAME(name, value, ROWS, KERNELS, PLACE, SHARE) const int name = value;
#define NUMBERED_NAME(name, value, function) const int name = value;
TAP_SETS(SET_NAME)
LINE_SETS(NUMBERED_NAME)
COMBINATIONS(NUMBERED_NAME, NUMBERED_NAME, NUMBERED_NAME, NUMBERED_NAME)
POINTS(NUMBERED_NAME)

#define SPECIALIZATION_CONSTANT(id, name, member) layout(constant_id = id) const int name = 0;
SPECIALIZATION_CONSTANTS(SPECIALIZATION_CONSTANT)

#include "lib/finite.glsl"
#include "lib/storage.glsl"
#include "lib/threshold.glsl"

// Like dot(), of which drivers choose the order: lavapipe 22.3.6 takes another one where it knows early that a channel
// is 0.
float inner_product(vec4 a, vec4 b)
{
    return a.r * b.r + a.g * b.g + a.b * b.b + a.a * b.a;
}
