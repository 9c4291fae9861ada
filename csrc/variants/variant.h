// What the files of variants share: variants.c has the table, blur_variants.c and level_variants.c
// what stands in it for blurs and for levels.
#ifndef VKB_VARIANT_H
#define VKB_VARIANT_H

#include "passes/composite.h"
#include "passes/threshold.h"
#include "variants/variants.h"
#include "vulkan/memory.h"

// The choice of variants for one graph: the passes of `plain` to those of `graph`.
struct vkb_variant_choice {
    enum vkb_variants variants;
    const struct vkb_device *device;
    struct vkb_graph plain;
    struct vkb_graph *graph;
};

// A variant adds what runs for a pass; false in *fits, and nothing added, where it does not suit
// it.
typedef bool vkb_variant_add(const struct vkb_variant_choice *choice,
                             const struct vkb_pass_row *pass, bool *fits, struct vkb_error *error);

// A blur's lines and enlarged lines; fused passes for the complete bloom of an image, in strips and
// tiles.
vkb_variant_add vkb_add_line, vkb_add_enlarged, vkb_add_strips, vkb_add_from_lines, vkb_add_tiles;
// Levels of exactly half and twice a size.
vkb_variant_add vkb_add_halved, vkb_add_doubled, vkb_add_doubled_final;

// The same for images as words.
#define VKB_WORDS_BY_FORMAT(shader) VKB_BY_FORMAT(shader##_words)

// What an image of the format gives back of what is stored: of STORED_*.
enum vkb_mode vkb_stored_as(const struct vkb_device *device, enum vkb_format format);

bool vkb_is_written_once(const struct vkb_graph *graph, uint32_t image);
// The last pass whose one target the image is; NULL: there is none.
const struct vkb_pass_row *vkb_writer_of(const struct vkb_graph *graph, uint32_t image);
// The threshold pass that writes `image` from an image of the same size and format; NULL: none.
const struct vkb_pass_row *vkb_threshold_of(const struct vkb_graph *graph, uint32_t image);

// The pass reads no more than so many of its images.
void vkb_drop_reads(struct vkb_pass_row *row, uint32_t read_count);

// Makes a dispatch of a pass over all pixels.
void vkb_make_dispatch(struct vkb_pass_row *row, enum vkb_shader shader, uint32_t block_width,
                       uint32_t block_height);
// Makes a dispatch of a pass whose images are words, by a block of so many columns and rows for
// each of ROW_INVOCATIONS.
void vkb_make_words(struct vkb_pass_row *row, enum vkb_shader shader, uint32_t columns,
                    uint32_t rows);
// Whether the images that a pass of words accesses are small enough for that.
bool vkb_fits_words(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass);
// A pass over all pixels of one target: on processors drawn, where its texels cannot be loaded, on
// GPUs a compute shader, for some of them (made to compute) draw slowly.
bool vkb_add_fullscreen(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                        struct vkb_error *error);

#endif
