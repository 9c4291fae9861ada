// What the files of vkb_unroll share: values and names (unroll_values.c), copies of instructions
// (unroll_copy.c), loops (unroll.c).
#ifndef VKB_UNROLL_PRIVATE_H
#define VKB_UNROLL_PRIVATE_H

#include "graph/module.h"

// What is larger stays as it is.
enum {
    MAX_WORDS = 1 << 18,
    MAX_IDS = 1 << 16,
    MAX_PLACES = 1 << 10,
    MAX_CONSTANTS = 1 << 10,
    MAX_PHIS = 64,
    MAX_ITERATIONS = 1 << 10,
};

// What an operand stands for in the copy of its instruction that was written last.
struct value {
    uint32_t name;    // of the result, of a block; 0: none yet
    uint32_t number;  // if `known`: an integer or a bool, which has no name
    bool known;
};

// An id of the module that is read.
struct id {
    const uint32_t *merge;  // of a label: how its loop is declared; NULL: it has none
    uint32_t before;        // of a label: the branches to it from blocks before it
    bool merges;            // of a label: a selection ends there
    bool decorated;
    uint32_t copies;  // of what is decorated: its last copy
    struct value value;
    size_t written;  // of an instruction: where its last copy is, and in which block; 0: none
    uint32_t block;
    uint32_t only;      // of a label: the one block that may follow; 0: any
    uint32_t place;     // of a pointer to a local variable: its first element
    uint32_t elements;  // of an array: their number
};

// A block that is written. `above` is the last one that all ways to it have in common.
struct block {
    uint32_t above, depth;
};

// An element of a local variable: its value, and the block that stored it.
struct place {
    struct value value;
    uint32_t block;
};

struct copy {
    uint32_t name, before;
};

struct constant {
    uint32_t type, number, name;
};

struct vkb_unrolled {
    struct vkb_module read;
    const uint32_t *loop_end;  // of the innermost loop that is written
    struct id *ids;
    struct block *blocks;  // by their names
    struct copy *copies;
    struct place places[MAX_PLACES];
    struct constant constants[MAX_CONSTANTS];
    uint32_t last_name, place_count, copy_count, constant_count, declared_count;
    struct vkb_code function;  // that is written
    uint32_t label, block;     // of the block that is written: its label, its name
    bool joined;               // the next block goes on with this one
    bool fits;
};

// Whether the module can be unrolled, as far as it is written.
bool vkb_fits(const struct vkb_unrolled *module);

bool vkb_is_local(const struct vkb_unrolled *module, uint32_t id);

struct value vkb_value_of(struct vkb_unrolled *module, uint32_t id);

// The name of an operand; that of a constant where its value is known.
uint32_t vkb_name_of(struct vkb_unrolled *module, uint32_t id);

uint32_t vkb_label_name(struct vkb_unrolled *module, uint32_t label);

// Gives the result of an instruction a new name, also for its decorations.
uint32_t vkb_name_result(struct vkb_unrolled *module, uint32_t result);

// Whether an instruction has a result that follows from what is known: its value.
bool vkb_evaluate(struct vkb_unrolled *module, const uint32_t *at, struct value *value);

// Whether all ways to this block come through another one.
bool vkb_is_behind(const struct vkb_unrolled *module, uint32_t block);

// Notes that this block may go on with another, and returns the other's name.
uint32_t vkb_go(struct vkb_unrolled *module, uint32_t label);

// Writes the copy of any instruction but a label and the declaration of a loop.
void vkb_copy_instruction(struct vkb_unrolled *module, const uint32_t *at);

#endif
