// Shared by the files of this folder: variants.c has the table of variants, the others the
// functions in it.
#ifndef VKB_VARIANT_H
#define VKB_VARIANT_H

#include "passes/composite.h"
#include "passes/threshold.h"
#include "variants/variants.h"
#include "vulkan/image.h"

// The complete lines of a convolution of those lengths (struct vkb_transform).
struct vkb_lines {
    uint32_t width, height;
    bool pads_rows, pads_columns;
    uint32_t x, y;  // elements of the lines
    bool held;      // the device can hold them
};

// The choice of variants for one graph: from the passes of `plain` to those of `graph`. It keeps
// the first failure.
struct vkb_variant_choice {
    enum vkb_column variants;
    const struct vkb_device *device;
    struct vkb_graph plain;
    struct vkb_graph *graph;
    struct vkb_error *error;
    bool failed;
    // The lines that were found last: all passes of a convolution ask for the same ones, and with a
    // search for each a plan of `camera_lens` takes 0.39 ms in place of 0.11.
    struct vkb_lines lines;
};

// Adds a pass to the graph. True, as every function that adds a variant.
bool vkb_add_variant_pass(struct vkb_variant_choice *choice, const struct vkb_pass_row *row);
// Adds an image of single floats.
uint32_t vkb_add_float_image(struct vkb_variant_choice *choice, const char *name,
                             struct vkb_size size);

// Adds the variant of a pass to the graph. False: it does not suit the pass, and nothing is added.
typedef bool vkb_variant_add(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass);

// Lines and enlarged lines of a blur; fused passes for the complete bloom of an image, in strips
// and in tiles.
vkb_variant_add vkb_add_line_variant, vkb_add_enlarged_variant, vkb_add_fused_variant;
// For derivatives of these by the image.
vkb_variant_add vkb_add_adjoint_fused_variant;
// Downsamplings that are not linear, and first passes of published methods.
vkb_variant_add vkb_add_windowed_variant;
// Blurs of nine taps, of images of the same size and of twice the size.
vkb_variant_add vkb_add_nine_variant;
// Filters in strips and in tiles, also fused with the composite; the sum of several levels that are
// filtered.
vkb_variant_add vkb_add_filtered_variant, vkb_add_filtered_final_variant, vkb_add_gathered_variant;
// Iterations of streaks.
vkb_variant_add vkb_add_streaks_variant;
// Sun beams and ghosts on the host.
vkb_variant_add vkb_add_host_beams_variant, vkb_add_host_ghosts_variant;
// Transforms of complete lines: in shared memory, or on the host.
vkb_variant_add vkb_add_transform_lines_variant, vkb_add_host_transform_variant;
// Adjoint passes: of images with linear texels; of downsamplings that are not linear, and of
// filters of bright colours, whose source may be the image itself; of the end of Blender's glare,
// fused with the composite's; transposed filters in tiles and in lines, fused with the composite's,
// and with those of the other pictures of an image.
vkb_variant_add vkb_add_adjoint_linear_variant, vkb_add_adjoint_first_variant,
    vkb_add_adjoint_end_variant, vkb_add_adjoint_filter_variant;
// Passes that load the pixel at their own position; any other pass as a compute shader.
vkb_variant_add vkb_add_pixels_variant;

// The same for images with linear texels.
#define VKB_LINEAR_BY_FORMAT(shader) VKB_BY_FORMAT(shader##_linear)

// Whether both images store pixels as the same bytes. (R11G11B10 is stored as single floats.)
bool vkb_has_format_of(const struct vkb_graph *graph, uint32_t a, uint32_t b);

bool vkb_is_written_once(const struct vkb_graph *graph, uint32_t image);
// The last pass of the filter that makes the bloom which a composite ends (vkb_ends_bloom); NULL:
// it is no filter.
const struct vkb_pass_row *vkb_bloom_of(const struct vkb_graph *graph,
                                        const struct vkb_pass_row *composite);
// The threshold pass that writes `image` from an image of the same size and format; NULL: no such
// pass.
const struct vkb_pass_row *vkb_threshold_of(const struct vkb_graph *graph, uint32_t image);

// If a threshold pass writes what `pass` reads, adds a fused pass that reads the image itself and
// may replace `variant`, that of `pass`. A pass that is no filter does so only if the threshold
// pass just removes NaN and infinity, as that of a published method does. Without it `DualKawase`
// takes 0.332 ms in place of 0.248, `bevy_natural` 0.414 in place of 0.325 (3840 x 2160 in float16,
// H200, 2026-11-28).
bool vkb_add_from_image_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass,
                                const struct vkb_pass_row *variant);

// After an adjoint filter that keeps the places of a transform's pixels, adds the last pass of the
// transform once more, as a fused pass that adds and leaves out what the filter does. With it, and
// without an alpha where there are three channels, the backward passes of `camera_lens` take 1.21
// ms in place of 1.39 (3840 x 2160, H200, 2026-11-30).
bool vkb_add_ended_lines_variant(struct vkb_variant_choice *choice,
                                 const struct vkb_pass_row *pass);

// Whether a pass gives the bloom a factor of the cotangents of its composite.
bool vkb_is_factor(const struct vkb_pass_row *pass);
// If such a pass writes the cotangents that a row reads, has the row read those of the composite in
// their place. Its own are these times the result, where the composite's scene is finite. The
// backward passes of `camera_lens` take 1.39 ms in place of 1.49, where a transform does so.
float vkb_read_composite(const struct vkb_graph *graph, enum vkb_slot cotangents,
                         enum vkb_slot scene, struct vkb_pass_row *row);

// Whether the images that a pass reads have linear texels of single floats.
bool vkb_are_floats(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass);

// Lets a row read single floats of its source, which a pass makes where it is none of them.
void vkb_read_host_floats(struct vkb_variant_choice *choice, struct vkb_pass_row *row);
// Adds a row as a pass on the host. Where its target is none of single floats, another pass stores
// them.
bool vkb_add_host_pass(struct vkb_variant_choice *choice, struct vkb_pass_row *row,
                       vkb_host_pass *host);

// Turns a pass over all pixels into a dispatch.
void vkb_make_dispatch(struct vkb_pass_row *row, const struct vkb_shader *shader,
                       uint32_t block_width, uint32_t block_height);
// Turns a pass with the constants of a filter into its tiles, whose pixels add up windows of
// `width` x `height` texels.
void vkb_make_tiles(const struct vkb_variant_choice *choice, struct vkb_pass_row *row,
                    const struct vkb_shader *shader, int32_t width, int32_t height);

// Turns a pass into a dispatch that accesses its images with linear texels. Each of the
// ROW_INVOCATIONS invocations of a workgroup writes a block of `columns` x `rows` pixels.
void vkb_make_linear(struct vkb_pass_row *row, const struct vkb_shader *shader, uint32_t columns,
                     uint32_t rows);
// Whether all images that the pass accesses are small enough for a view of their linear texels.
bool vkb_fits_linear(const struct vkb_variant_choice *choice, const struct vkb_pass_row *pass);
// A pass over all pixels of one target. On CPUs it is drawn if its texels cannot be loaded. On GPUs
// it is a compute shader, since GPUs that are made for computing draw slowly.
bool vkb_add_fullscreen_variant(struct vkb_variant_choice *choice, const struct vkb_pass_row *pass);

#endif
