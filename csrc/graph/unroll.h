// Loops of a module that has no specialization constants, one iteration after another, and its
// local arrays as values. A CPU's driver would do both in each process, before it asks its cache.
#ifndef VKB_UNROLL_H
#define VKB_UNROLL_H

#include "vulkan/error.h"

#include <stddef.h>
#include <stdint.h>

// Replaces `*code`, of vkb_specialize, and its `*size` in bytes. A module stays as it is if it has
// a loop whose number of iterations is not known or that is left early, an array at whose places
// values depend on a condition, or an instruction that no shader of the package has.
bool vkb_unroll(uint32_t **code, size_t *size, struct vkb_error *error);

#endif
