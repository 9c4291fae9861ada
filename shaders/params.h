// Every parameter of the pipeline, declared once.
//
// SETTING_ROWS, COUNT_ROWS and REAL_ROWS are the numbers that a user sets: C makes struct
// vkb_values of them and the table of names, defaults and ranges that Python builds its settings
// from (csrc/graph/params.c). Each pass has a block of parameters. GLSL expands its rows into a
// std140 uniform block (block.glsl), C into the matching struct. A row names its block B and is
// one of
//
//   READS(B, name)         a setting of SETTING_ROWS; when it changes, the pass is out of date
//   INPUT(B, type, name)   a float or int that the core fills in for each pass
//   VEC4S(B, name, count)  an array of vec4 that the core fills in for each pass
//
// The numbers of the stages of glare are in lists of their own, GLARE_SETTING_ROWS and
// GLARE_COUNT_ROWS: settings can have several stages. The core fills them in.
//
// The block of a fused pass has the rows of the passes that it replaces.

// The settings that shaders read: floats, SETTING(name, default, min, max).
#define SETTING_ROWS(SETTING) \
    SETTING(threshold, 0.0, 0.0, 65504.0) \
    SETTING(knee, 0.0, 0.0, 1.0) \
    SETTING(highlight, 1000.0, 10.0, 65504.0) \
    SETTING(clamp_max, 65472.0, 0.0, 65504.0) \
    SETTING(smooth_width, 0.01, 0.0001, 65504.0) \
    SETTING(threshold_scale, 2.0, 0.0, 65504.0) \
    SETTING(luminance_cap, 12.0, 0.0, 65504.0) \
    SETTING(glow_bloom, 0.0, 0.0, 1.0) \
    SETTING(strength, 1.0, 0.0, 16.0) \
    SETTING(white, 1.0, 0.01, 65504.0) \
    SETTING(smoothness, 0.1, 0.0, 1.0) \
    SETTING(maximum, 3.4e38, 0.0, 65504.0) \
    SETTING(saturation, 1.0, 0.0, 16.0) \
    SETTING(intensity, 1.0, 0.0, 65504.0) \
    SETTING(exposure, 0.0, -32.0, 32.0) \
    SETTING(reference_white, 203.0, 1.0, 10000.0)

// For a pass that reads an image of another size: the size of its target.
#define SAMPLING_ROWS(B, INPUT) \
    INPUT(B, int, target_width) \
    INPUT(B, int, target_height)

// For passes with a threshold, and for passes that write the finished picture, with the largest
// value of its format.
#define THRESHOLD_ROWS(B, READS) \
    READS(B, threshold) \
    READS(B, knee)
#define COMPOSITE_ROWS(B, READS, INPUT) \
    READS(B, intensity) \
    READS(B, exposure) \
    READS(B, reference_white) \
    READS(B, white) \
    INPUT(B, float, limit) \
    INPUT(B, int, noise_seed)

// The matrices of a mesh or skybox draw. Only what is not constant is passed, in a form that is
// ready for the vertex shader: llvmpipe compiles a test of the bounds for each number that a shader
// loads. `projection` has the scales of x, y and z and the offset of z, `model_view` three rows.
// `sky` has the direction of the picture's centre and its changes from there to the right and to
// the lower edge. The glow mesh's colours are multiplied by the intensity before the threshold.
#define MESH_BLOCK(B, READS, INPUT, VEC4S) \
    VEC4S(B, projection, 1) \
    VEC4S(B, model_view, 3) \
    VEC4S(B, sky, 3) \
    VEC4S(B, before, 3) \
    VEC4S(B, jitter, 1) \
    INPUT(B, float, glow_intensity) \
    THRESHOLD_ROWS(B, READS)

// A filter along a line of integer texels: a symmetric kernel from the first tap to the last, then
// zeros. `origin` is the position of the target's first pixel in the source, along the line. For
// ROLLED, so that both directions share a pipeline: whether lines are columns, and whether texels
// are 8-bit levels.
#define LINE_BLOCK(B, READS, INPUT, VEC4S) \
    INPUT(B, int, radius) \
    INPUT(B, int, origin) \
    INPUT(B, int, vertical) \
    INPUT(B, int, levels) \
    VEC4S(B, kernel, (2 * LINE_RADIUS + LINE_OUTPUTS) / 4)

// The complete bloom of an image in one fused pass: threshold, both blurs, composite. Kernels as in
// LINE_BLOCK. `columns` are those that an invocation of strip.comp writes.
#define FUSED_BLOOM_BLOCK(B, READS, INPUT, VEC4S) \
    THRESHOLD_ROWS(B, READS) \
    COMPOSITE_ROWS(B, READS, INPUT) \
    INPUT(B, int, columns) \
    VEC4S(B, vertical, TILE_RADIUS / 4 + 1) \
    VEC4S(B, horizontal, TILE_RADIUS / 4 + 1)

// The threshold pass, which also reduces an image to the size of the bloom buffers.
#define THRESHOLD_BLOCK(B, READS, INPUT, VEC4S) \
    SAMPLING_ROWS(B, INPUT) \
    THRESHOLD_ROWS(B, READS)

// A filter (lib/filter.glsl): `same_size` and `coarse` are the shares of an image of the target's size
// and of the filtered image, whose weights have the sum `divisor`; the texel at which the source
// begins for the positions of pixels (0, unless the filter is moved); the taps along rows and along
// columns.
#define FILTER_ROWS(B, INPUT, VEC4S) \
    INPUT(B, float, same_size) \
    INPUT(B, float, coarse) \
    INPUT(B, float, divisor) \
    INPUT(B, int, first_x) \
    INPUT(B, int, first_y) \
    VEC4S(B, taps_x, MAX_FILTER_TAPS) \
    VEC4S(B, taps_y, MAX_FILTER_TAPS)

// A linear pass: what its filters (csrc/graph/filter.h) are for the device. Of a filter with a long
// kernel: the distances of its taps in texels of the source, and its half-kernel w0.., four weights
// in a vec4; where PLACED is set, the distances are `offsets` of the steps. Of a sum of levels:
// their weights. The threshold is for a pass that reads the image itself.
#define FILTER_BLOCK(B, READS, INPUT, VEC4S) \
    SAMPLING_ROWS(B, INPUT) \
    FILTER_ROWS(B, INPUT, VEC4S) \
    INPUT(B, float, step_x) \
    INPUT(B, float, step_y) \
    VEC4S(B, weights, (MAX_WEIGHTS + 3) / 4) \
    VEC4S(B, offsets, (MAX_OFFSETS + 3) / 4) \
    VEC4S(B, shares, (GATHERED_LEVELS + 3) / 4) \
    THRESHOLD_ROWS(B, READS)

// A filter that makes the bloom, fused with the composite.
#define FILTER_FINAL_BLOCK(B, READS, INPUT, VEC4S) \
    SAMPLING_ROWS(B, INPUT) \
    FILTER_ROWS(B, INPUT, VEC4S) \
    COMPOSITE_ROWS(B, READS, INPUT)

// A pass that is no filter: one that weights its taps by brightness, and the first pass of a
// published method, which reads the frame (PREFILTERS). The steps are the distances of places in
// texels of what it reads.
#define PREFILTER_BLOCK(B, READS, INPUT, VEC4S) \
    SAMPLING_ROWS(B, INPUT) \
    INPUT(B, float, step_x) \
    INPUT(B, float, step_y) \
    THRESHOLD_ROWS(B, READS) \
    READS(B, highlight) \
    READS(B, clamp_max) \
    READS(B, smooth_width) \
    READS(B, threshold_scale) \
    READS(B, luminance_cap) \
    READS(B, glow_bloom) \
    READS(B, strength) \
    READS(B, smoothness) \
    READS(B, maximum) \
    INPUT(B, float, exposure) \
    VEC4S(B, tint, 1)

// An iteration of a streak (streaks.frag): `count` taps, the step between them in texels, and the
// weight of each for each channel. The threshold is for the first iteration. With `reads_next`,
// `next` has the bits of next_texel() for each tap.
#define STREAKS_BLOCK(B, READS, INPUT, VEC4S) \
    INPUT(B, float, threshold) \
    INPUT(B, float, step_x) \
    INPUT(B, float, step_y) \
    INPUT(B, int, count) \
    INPUT(B, int, reads_next) \
    VEC4S(B, weights, MAX_TAPS) \
    VEC4S(B, next, MAX_TAPS)

// Of an adjoint pass in which texels near a centre gather from too many pixels for an invocation
// (lib/summed.glsl): `summed_blocks` blocks around the centre, each of which contains those before
// it. A block has two texels of `summed`: x, y, width and height; the groups that have its pixels,
// how many of them are beside each other in the image of their sums, and the row where they begin.
#define SUMMED_ROWS(B, INPUT, VEC4S) \
    INPUT(B, int, summed_blocks) \
    VEC4S(B, summed, 2 * MAX_SUMMED)

// Ghosts and halo (ghosts.frag, halo.frag): `ghosts` has the tint and the scale of each of `count`
// ghosts. SUMMED_ROWS are of adjoints.
#define FLARE_BLOCK(B, READS, INPUT, VEC4S) \
    INPUT(B, float, threshold) \
    INPUT(B, float, maximum) \
    INPUT(B, float, aberration) \
    INPUT(B, float, radius) \
    INPUT(B, float, falloff) \
    INPUT(B, float, vignette) \
    INPUT(B, float, width) \
    INPUT(B, int, count) \
    SUMMED_ROWS(B, INPUT, VEC4S) \
    VEC4S(B, ghosts, MAX_GHOSTS)

// What a picture of dirt leaves of the light: base + share * dirt (dirt.frag).
#define DIRT_BLOCK(B, READS, INPUT, VEC4S) \
    SAMPLING_ROWS(B, INPUT) \
    INPUT(B, float, base) \
    INPUT(B, float, share)

// The end of Blender's glare (blender_end.frag): one factor for each channel; up to which
// difference the derivatives count channels as equal, which they are but for the rounding of a
// convolution.
#define BLENDER_END_BLOCK(B, READS, INPUT, VEC4S) \
    SAMPLING_ROWS(B, INPUT) \
    READS(B, saturation) \
    INPUT(B, float, rounding) \
    INPUT(B, int, reads_next) \
    VEC4S(B, factors, 1) \
    VEC4S(B, next, 1)

// Blender's recursive filter along lines (simple_star.comp), each of which an invocation follows
// from its end at the left or right or at the bottom, or back from its other end.
#define STAR_BLOCK(B, READS, INPUT, VEC4S) \
    INPUT(B, int, step_x) \
    INPUT(B, int, step_y) \
    INPUT(B, int, backwards) \
    INPUT(B, float, fade)

// A mean of pixels along rows or columns (box_mean.comp).
#define BOX_BLOCK(B, READS, INPUT, VEC4S) \
    INPUT(B, int, across) \
    INPUT(B, int, radius)

// Blender's sun beams (sun_beams.frag): the most steps; the sun from the upper left, as shares of
// the sides; the share of the samples that jitter leaves. The rest is of adjoints: highlights of
// blocks of dark_side x dark_side pixels that are all below dark_below are 0, and so is their slope.
#define SUN_BEAMS_BLOCK(B, READS, INPUT, VEC4S) \
    INPUT(B, int, most) \
    INPUT(B, float, sun_x) \
    INPUT(B, float, sun_y) \
    INPUT(B, float, left) \
    INPUT(B, float, dark_below) \
    INPUT(B, int, dark_side) \
    SUMMED_ROWS(B, INPUT, VEC4S)

#define COMPOSITE_BLOCK(B, READS, INPUT, VEC4S) COMPOSITE_ROWS(B, READS, INPUT)

// The numbers of an exposure that Python packs in this order, each of which some engines have: ends
// of what is metered in log2, shares of the histogram that count, limits of the value adapted to;
// what a step of the time multiplies the distance from a goal by that is above or below, or how far
// it goes at the most; how the mean becomes the goal; the weights of HDRP's metering; the ends of
// the luminances of the table. EXPOSURE_BLOCK has the sizes of what is metered beside these.
#define EXPOSURE_NUMBER_ROWS(B, INPUT) \
    INPUT(B, float, low) \
    INPUT(B, float, high) \
    INPUT(B, float, cut_low) \
    INPUT(B, float, cut_high) \
    INPUT(B, float, minimum) \
    INPUT(B, float, maximum) \
    INPUT(B, float, step_up) \
    INPUT(B, float, step_down) \
    INPUT(B, float, scale) \
    INPUT(B, float, compensation) \
    INPUT(B, float, grey) \
    INPUT(B, float, masked) \
    INPUT(B, float, metering) \
    INPUT(B, float, centre_x) \
    INPUT(B, float, centre_y) \
    INPUT(B, float, radius_x) \
    INPUT(B, float, radius_y) \
    INPUT(B, float, power) \
    INPUT(B, float, least) \
    INPUT(B, float, most) \
    INPUT(B, float, table_low) \
    INPUT(B, float, table_high)

#define EXPOSURE_BLOCK(B, READS, INPUT, VEC4S) \
    EXPOSURE_NUMBER_ROWS(B, INPUT) \
    INPUT(B, int, width) \
    INPUT(B, int, height) \
    INPUT(B, int, columns) \
    INPUT(B, int, channel) \
    VEC4S(B, table, EXPOSURE_TABLE / 4)

// The numbers of temporal anti-aliasing that Python packs in this order, each of which some engines
// have. TAA_BLOCK has the weights of 3 x 3 pixels by rows beside these, for `phases` frames: twelve
// numbers each.
#define TAA_NUMBER_ROWS(B, INPUT) \
    INPUT(B, float, weight) \
    INPUT(B, float, min_weight) \
    INPUT(B, float, still) \
    INPUT(B, float, frames) \
    INPUT(B, float, moving_box) \
    INPUT(B, float, disocclusion) \
    INPUT(B, float, gamma) \
    INPUT(B, float, damping) \
    INPUT(B, float, sharpening) \
    INPUT(B, float, sharpness) \
    INPUT(B, float, flicker) \
    INPUT(B, float, contrast) \
    INPUT(B, float, phases)

#define TAA_BLOCK(B, READS, INPUT, VEC4S) \
    TAA_NUMBER_ROWS(B, INPUT) \
    VEC4S(B, weights, 3 * TAA_PHASES)

// The transpose of a filter (adjoint_filter.frag): where the tables of both axes start, in texels;
// the factor of the colours of what is added, and how much less it is for each unit of a mask. For
// tiles: where the tables of each picture start; in a simple ratio the weights of texels that are
// not near an edge, of even ones, then of odd ones.
#define ADJOINT_FILTER_BLOCK(B, READS, INPUT, VEC4S) \
    INPUT(B, int, start_x) \
    INPUT(B, int, start_y) \
    INPUT(B, float, gain) \
    INPUT(B, float, share) \
    INPUT(B, float, share_of_mask) \
    VEC4S(B, pictures, MAX_PICTURES) \
    VEC4S(B, inner_x, FILTER_TILE_WINDOW / 2) \
    VEC4S(B, inner_y, FILTER_TILE_WINDOW / 2)

// A stage of a Fourier transform along one axis (fft.comp). There are `across` lines of `padded`
// elements, with `count` butterflies in each line. The elements of a butterfly are `step` apart.
// Elements from `kept` on are not stored. The first stage pads the line: `extent` elements from
// `first` on are texels, and elements from `turn` on are positions before the first texel. The
// product is one with the kernel's spectrum; with its conjugate where `kernel_sign` is -1, which is
// the transpose of the convolution. That with a kernel with colours reads the frequency of the
// opposite sign. To find it, it needs the radices of the rows' stages (`row_a` to `row_d`;
// `row_last` is the last one that is used), the rows' number of elements, and the radices of the
// columns' stages without the last one. WEIGHTED: what is read on the way forth, or what is stored
// on the way back, is multiplied by the channel `weight` of the weights; along columns by those of
// the first column. The result has so many texels before the first one of the weights. In complete
// lines a row of a channel has so many `frequencies`. THROUGH_COMPOSITE: what is read is multiplied by
// the `gain` where the composite's scene is finite. ADDS_IMAGE: a `share` of the colours is added.
#define FFT_BLOCK(B, READS, INPUT, VEC4S) \
    INPUT(B, int, count) \
    INPUT(B, int, across) \
    INPUT(B, int, step) \
    INPUT(B, int, kept) \
    INPUT(B, int, padded) \
    INPUT(B, int, extent) \
    INPUT(B, int, first) \
    INPUT(B, int, turn) \
    INPUT(B, float, kernel_sign) \
    INPUT(B, int, row_length) \
    INPUT(B, int, row_a) \
    INPUT(B, int, row_b) \
    INPUT(B, int, row_c) \
    INPUT(B, int, row_d) \
    INPUT(B, int, row_last) \
    INPUT(B, int, block_a) \
    INPUT(B, int, block_b) \
    INPUT(B, int, block_c) \
    INPUT(B, float, prefilter_min) \
    INPUT(B, float, prefilter_max) \
    INPUT(B, float, prefilter_factor) \
    INPUT(B, int, weight) \
    INPUT(B, int, before_x) \
    INPUT(B, int, before_y) \
    INPUT(B, int, frequencies) \
    INPUT(B, float, gain) \
    INPUT(B, float, share)

// Writes the kernel into padded lines (fft_kernel.comp). For each axis: the kernel's number of
// texels, the first and the last that are not 0, how many before and after its centre count, and the
// period of the line. `grey`: all channels are equal. Complete lines have so many `channels`; 0: a
// texel has all.
#define FFT_KERNEL_BLOCK(B, READS, INPUT, VEC4S) \
    INPUT(B, int, padded_x) \
    INPUT(B, int, boundary_x) \
    INPUT(B, int, extent_x) \
    INPUT(B, int, first_x) \
    INPUT(B, int, last_x) \
    INPUT(B, int, period_x) \
    INPUT(B, int, before_x) \
    INPUT(B, int, after_x) \
    INPUT(B, int, padded_y) \
    INPUT(B, int, boundary_y) \
    INPUT(B, int, extent_y) \
    INPUT(B, int, first_y) \
    INPUT(B, int, last_y) \
    INPUT(B, int, period_y) \
    INPUT(B, int, before_y) \
    INPUT(B, int, after_y) \
    INPUT(B, int, grey) \
    INPUT(B, int, channels) \
    INPUT(B, float, gain)

// The sum of products of spectra (products.frag). Where the spectra of coloured kernels are in
// stages, the radices of both axes, as above; `kernel_sign` as above. A grey kernel of complete lines
// has so many `frequencies` for all channels; 0: it has as many texels as the image.
#define PRODUCTS_BLOCK(B, READS, INPUT, VEC4S) \
    INPUT(B, float, kernel_sign) \
    INPUT(B, int, row_length) \
    INPUT(B, int, row_a) \
    INPUT(B, int, row_b) \
    INPUT(B, int, row_c) \
    INPUT(B, int, row_d) \
    INPUT(B, int, column_length) \
    INPUT(B, int, column_a) \
    INPUT(B, int, column_b) \
    INPUT(B, int, column_c) \
    INPUT(B, int, column_d) \
    INPUT(B, int, frequencies)

// The weights of a field at each pixel (field_weights.frag): which four of them, columns and rows of
// the grid of weights, and how many grids are side by side.
#define FIELD_WEIGHTS_BLOCK(B, READS, INPUT, VEC4S) \
    INPUT(B, int, grid) \
    INPUT(B, int, columns) \
    INPUT(B, int, rows) \
    INPUT(B, int, grids)

// Sums of pixels between the places of a field's grid (adjoint_weights.frag): the intervals between
// places, the parts of each, and the lines of a picture of sums.
#define NODE_SUMS_BLOCK(B, READS, INPUT, VEC4S) \
    INPUT(B, int, cells) \
    INPUT(B, int, parts) \
    INPUT(B, int, lines)

// Of a pass that was given at run time: bytes whose layout only its shader knows.
#define CUSTOM_BLOCK(B, READS, INPUT, VEC4S) VEC4S(B, values, 64)

#define PARAMETER_BLOCKS(BLOCK) \
    BLOCK(custom, CUSTOM_BLOCK) \
    BLOCK(mesh, MESH_BLOCK) \
    BLOCK(threshold, THRESHOLD_BLOCK) \
    BLOCK(line, LINE_BLOCK) \
    BLOCK(fused_bloom, FUSED_BLOOM_BLOCK) \
    BLOCK(filter, FILTER_BLOCK) \
    BLOCK(filter_final, FILTER_FINAL_BLOCK) \
    BLOCK(prefilter, PREFILTER_BLOCK) \
    BLOCK(streaks, STREAKS_BLOCK) \
    BLOCK(flare, FLARE_BLOCK) \
    BLOCK(dirt, DIRT_BLOCK) \
    BLOCK(blender_end, BLENDER_END_BLOCK) \
    BLOCK(star, STAR_BLOCK) \
    BLOCK(box, BOX_BLOCK) \
    BLOCK(sun_beams, SUN_BEAMS_BLOCK) \
    BLOCK(fft, FFT_BLOCK) \
    BLOCK(fft_kernel, FFT_KERNEL_BLOCK) \
    BLOCK(products, PRODUCTS_BLOCK) \
    BLOCK(field_weights, FIELD_WEIGHTS_BLOCK) \
    BLOCK(node_sums, NODE_SUMS_BLOCK) \
    BLOCK(composite, COMPOSITE_BLOCK) \
    BLOCK(adjoint_filter, ADJOINT_FILTER_BLOCK) \
    BLOCK(exposure, EXPOSURE_BLOCK) \
    BLOCK(taa, TAA_BLOCK)

// Settings that no shader reads, because they shape the graph. Integers: COUNT(name, default, min,
// max); a flag is one of 0 and 1.
#define COUNT_ROWS(COUNT) \
    COUNT(bloom, 1, 0, 1) \
    COUNT(dither, 0, 0, 1) \
    COUNT(dither_seed, 0, 0, 65535) \
    COUNT(loops, 1, 1, 16) \
    COUNT(first_tap, 1, 0, 1) \
    COUNT(direct, 0, 0, 1) \
    COUNT(levels, 6, 1, 16) \
    COUNT(firefly_filter, 0, 0, 1) \
    COUNT(max_mip_dimension, 512, 4, 4096) \
    COUNT(anti_flicker, 1, 0, 1) \
    COUNT(resolution, 384, 16, 2048) \
    COUNT(iterations, 6, 2, 8) \
    COUNT(high_quality_filtering, 1, 0, 1) \
    COUNT(bicubic, 1, 0, 1) \
    COUNT(karis_average, 0, 0, 1) \
    COUNT(streaks, 4, 1, 16) \
    COUNT(diagonal, 1, 0, 1) \
    COUNT(fast, 0, 0, 1) \
    COUNT(quarter, 0, 0, 1) \
    COUNT(urp_12, 0, 0, 1) \
    COUNT(blender_5_2, 0, 0, 1)

// Real numbers. They are doubles, so that sizes are computed as in Python.
#define REAL_ROWS(REAL) \
    REAL(blur_scale, 1.0, 0.0, 16.0) \
    REAL(blur_strength, 1.5, 0.0, 16.0) \
    REAL(bloom_scale, 1.0, 0.001, 4.0) \
    REAL(radius, 1.0, 0.0, 16.0) \
    REAL(offset, 1.0, 0.0, 16.0) \
    REAL(low_frequency_boost, 0.7, 0.0, 1.0) \
    REAL(low_frequency_boost_curvature, 0.95, 0.0, 0.99) \
    REAL(high_pass_frequency, 1.0, 0.001, 1.0) \
    REAL(scatter, 0.7, 0.0, 1.0) \
    REAL(scale_x, 1.0, 0.0, 16.0) \
    REAL(scale_y, 1.0, 0.0, 16.0) \
    REAL(anamorphism, 0.0, -1.0, 1.0) \
    REAL(size, 0.5, 0.0, 1.0) \
    REAL(filter_radius, 0.005, 0.0, 1.0) \
    REAL(streaks_angle, 0.0, -360.0, 360.0) \
    REAL(fade, 0.9, 0.75, 1.0) \
    REAL(color_modulation, 0.25, 0.0, 1.0) \
    REAL(jitter, 0.0, 0.0, 1.0) \
    REAL(diffusion, 7.0, 1.0, 10.0) \
    REAL(size_scale, 4.0, 0.0, 64.0)

// The numbers of the stages of glare: floats and integers, as above. Each stage has some of them.
#define GLARE_SETTING_ROWS(SETTING) \
    SETTING(intensity, 1.0, 0.0, 65504.0) \
    SETTING(threshold, 0.0, 0.0, 65504.0) \
    SETTING(angle, 0.0, -360.0, 360.0) \
    SETTING(length, 1.0, 0.0, 16.0) \
    SETTING(fade, 0.95, 0.0, 1.0) \
    SETTING(colour_shift, 0.0, 0.0, 1.0) \
    SETTING(maximum, 65504.0, 0.0, 65504.0) \
    SETTING(aberration, 0.0, 0.0, 0.5) \
    SETTING(radius, 1.0, 0.001, 4.0) \
    SETTING(falloff, 0.0, 0.0, 64.0) \
    SETTING(vignette, 0.0, 0.0, 1.0) \
    SETTING(width, 0.1, 0.001, 4.0) \
    SETTING(strength, 1.0, 0.0, 16.0)

#define GLARE_COUNT_ROWS(COUNT) \
    COUNT(halvings, 2, 0, MAX_HALVINGS) \
    COUNT(directions, 6, 1, 16) \
    COUNT(base, 4, 2, MAX_TAPS) \
    COUNT(iterations, 4, 1, 6) \
    COUNT(lerp, 0, 0, 1) \
    COUNT(seed, 0, 0, 65535)

// The largest values of half floats and of floats.
#define HALF_LIMIT   65504.0
#define SINGLE_LIMIT 3.402823466e38

// The longest half-kernel (w0..w64), the longest one whose taps are at given places, and the most
// layers of one blur.
#define MAX_WEIGHTS 65
#define MAX_OFFSETS 12
#define MAX_LAYERS  8

// Of Unreal Engine's standard bloom.
#define MAX_GAUSSIANS 6

// Of glare: the most stages (the bloom and a picture of dirt are added up with them) and ghosts,
// the taps of an iteration of a streak, and how often the size of the bloom buffers is halved.
#define MAX_STAGES   (GATHERED_LEVELS - 2)
#define MAX_GHOSTS   16
#define MAX_TAPS     8
#define MAX_HALVINGS 4

// The most blocks of SUMMED_ROWS, and the side of the cell of texels that an invocation has of the
// transpose of sun beams (adjoint_beams.comp).
#define MAX_SUMMED 12
#define BEAM_CELL  2

// Samples of sun beams that are passed over together where there is no light, and the side of the
// blocks of texels for which this is known (beam_dark.frag). With the half texel by which Blender
// measures the way to the sun from another place, samples that follow one are less than BEAM_RUN
// texels away from it.
#define BEAM_RUN   8
#define BEAM_BLOCK 16

// Of exposures: the numbers of a table; the samples along both sides of a tile whose histogram a
// workgroup makes, which single floats count, and its invocations along these; the most bins; the
// points along both sides of HDRP's automatic metering, and of a tile of them; the side of a block
// of a mean.
#define EXPOSURE_TABLE       256
#define METER_TILE           64
#define METER_INVOCATIONS    8
#define METER_BINS           128
#define METER_POINTS         1024
#define METER_TILE_POINTS    32
#define METER_BLOCK          8
#define METER_SUM_INVOCATIONS 64

// The engines of exposures: EXPOSURE(name, value, name in Python, bins, apart, exposes). A histogram
// has `bins`, of samples that are `apart` pixels apart along both axes; 0: there is none. `exposes`
// are EXPOSES_*: the light that the bloom reads, the picture with its bloom, which METERS_BLOOM
// meters, too; EXPOSES_FIRST: before temporal anti-aliasing. 0: there is no exposure.
#define EXPOSES_BLOOM   1
#define EXPOSES_PICTURE 2
#define METERS_BLOOM    4
#define EXPOSES_FIRST   8
#define EXPOSURES(EXPOSURE) \
    EXPOSURE(EXPOSURE_FIXED, 1, fixed, 0, 0, EXPOSES_BLOOM) \
    EXPOSURE(EXPOSURE_KEYFRAMED, 2, keyframed, 0, 0, EXPOSES_BLOOM) \
    EXPOSURE(EXPOSURE_BEVY, 3, bevy, 64, 1, EXPOSES_PICTURE) \
    EXPOSURE(EXPOSURE_HDRP, 4, hdrp, 128, 2, EXPOSES_BLOOM | EXPOSES_FIRST) \
    EXPOSURE(EXPOSURE_AUTOMATIC, 5, hdrp_automatic, 0, 0, EXPOSES_BLOOM | EXPOSES_FIRST) \
    EXPOSURE(EXPOSURE_PPV2, 6, ppv2, 128, 2, EXPOSES_BLOOM) \
    EXPOSURE(EXPOSURE_GODOT, 7, godot, 0, 0, EXPOSES_BLOOM) \
    EXPOSURE(EXPOSURE_O3DE, 8, o3de, 0, 0, EXPOSES_PICTURE | METERS_BLOOM) \
    EXPOSURE(EXPOSURE_GRANITE, 9, granite, 0, 0, EXPOSES_BLOOM | EXPOSES_PICTURE)

// The engines of temporal anti-aliasing: TAA(name, value, name in Python, its shader). Weights of a
// filter of the frame repeat after TAA_PHASES frames at the most.
#define TAA_PHASES 16
#define TAAS(TAA) \
    TAA(TAA_BEVY, 1, bevy, taa_bevy) \
    TAA(TAA_GODOT, 2, godot, taa_godot) \
    TAA(TAA_O3DE, 3, o3de, taa_o3de) \
    TAA(TAA_HDRP_LOW, 4, hdrp_low, taa_hdrp) \
    TAA(TAA_HDRP_MEDIUM, 5, hdrp_medium, taa_hdrp) \
    TAA(TAA_HDRP_HIGH, 6, hdrp_high, taa_hdrp)

// The most iterations of Blender's streaks and of its star, whose distances are fewer by one.
#define STAR_ITERATIONS 5

// The images that a pass reads, by the slots of its family: SLOT(name, number), the index in the
// row's `reads`. A family has the slots of its list and SLOT_SOURCE, all adjoint passes have one.
// The images of other slots are absent.
#define SLOTS(SLOT) \
    SLOT(SLOT_SOURCE, 0) /* what the pass samples, or what its forward pass has sampled */ \
    COMPOSITE_SLOTS(SLOT) \
    ADJOINT_SLOTS(SLOT) \
    FUSED_SLOTS(SLOT) \
    FILTER_SLOTS(SLOT) \
    GLARE_SLOTS(SLOT) \
    EXPOSURE_SLOTS(SLOT) \
    TAA_SLOTS(SLOT) \
    TRANSFORM_SLOTS(SLOT) \
    LIGHTING_SLOTS(SLOT)

// The composite, and passes that read a mask: thresholds, first passes of published methods.
#define COMPOSITE_SLOTS(SLOT) \
    SLOT(SLOT_SCENE, 0) \
    SLOT(SLOT_BLOOM, 1) \
    SLOT(SLOT_MASK, 2)

// Adjoint passes have these, and those of COMPOSITE_SLOTS that their forward pass has. (A pass
// whose transpose is the same pass has its slots.)
#define ADJOINT_SLOTS(SLOT) \
    SLOT(SLOT_COTANGENTS, 3)     /* of what the forward pass has written */ \
    SLOT(SLOT_WEIGHTS, 4)        /* of transposed filters: the table of their weights */ \
    SLOT(SLOT_SUMS, 4)           /* of SUMMED_ROWS: the sums of groups of rows */ \
    SLOT(SLOT_ADDED, 5)          /* what other readers of the image have accumulated */ \
    SLOT(SLOT_DIFFERENTIATED, 6) /* the image itself, if it is a source's */

// Fused passes that end with a composite, or begin with its transpose. Its scene is at SLOT_SOURCE,
// or, where that is another image, at SLOT_ENDED.
#define FUSED_SLOTS(SLOT) \
    SLOT(SLOT_ENDED, 2)        /* see lib/ended.glsl */

// Filters, and sums of up to GATHERED_LEVELS levels.
#define FILTER_SLOTS(SLOT) \
    SLOT(SLOT_SAME_SIZE, 1)    /* an image of the target's size that is added */ \
    SLOT(SLOT_LEVELS, 0) /* the first level */

#define GLARE_SLOTS(SLOT) \
    SLOT(SLOT_BEFORE, 1) /* the light that a ray, ghosts or a star is added to */ \
    SLOT(SLOT_DIRT, 1)   /* the picture of dirt */ \
    SLOT(SLOT_DARK, 1)   /* where sun beams need no samples */

#define EXPOSURE_SLOTS(SLOT) \
    SLOT(SLOT_EXPOSURE, 1) /* of this frame, or of the one before */ \
    SLOT(SLOT_METER_MASK, 1)

// Temporal anti-aliasing: what it has kept of this frame, or of the one before; the motion of the
// frame before; what the caller gives.
#define TAA_SLOTS(SLOT) \
    SLOT(SLOT_HISTORY, 1) \
    SLOT(SLOT_LAST_MOTION, 2) \
    SLOT(SLOT_MOTION_X, 3) \
    SLOT(SLOT_MOTION_Y, 4) \
    SLOT(SLOT_DEPTH, 5)

// Of fields of kernels they have SLOT_WEIGHTS and SLOT_ADDED of the adjoint passes, too.
#define TRANSFORM_SLOTS(SLOT) \
    SLOT(SLOT_SPECTRUM, 1) /* of the kernel, for the product */ \
    SLOT(SLOT_ADDED_SPECTRUM, 2) /* of complete lines: what columns add on their way back */ \
    SLOT(SLOT_THROUGH, 3) /* the same: the scene of THROUGH_COMPOSITE */ \
    SLOT(SLOT_FACTORS, 1)  /* of up to MAX_PRODUCTS: the spectra of glow and kernel in turns */ \
    SLOT(SLOT_PLACES, 1)   /* where columns and rows are in the grid of weights */ \
    SLOT(SLOT_NODES, 5)    /* the same, beside up to four SLOT_FACTORS */

// The G-buffer.
#define LIGHTING_SLOTS(SLOT) \
    SLOT(SLOT_ALBEDO, 0) \
    SLOT(SLOT_NORMAL, 1) \
    SLOT(SLOT_POSITION, 2) \
    SLOT(SLOT_BRIGHTNESS, 3)

// The binding of the target of a compute shader: after those that images and resources may have.
#define TARGET_BINDING 33

// Invocations of a workgroup: in a row, for shaders in which each invocation writes several pixels;
// on each side, for shaders in which it writes one.
#define ROW_INVOCATIONS   8
#define PIXEL_INVOCATIONS 8

// Kernels on integer texels, w0.. in vec4s: the longest half-kernel of a line and of a fused bloom.
// A line up to LINE_SHORT_RADIUS is compiled for its radius. On a CPU, for a target of at most
// ROLLED_PIXELS that takes longer than the pass, unless the loop over its pixels stays one. Longer
// lines up to LINE_ROLLED_RADIUS have this loop in all images: with a radius of 12, `Separable` takes
// 200 ms without it, 87 with it, and the two lines of 32 of `blender_ghosts` 132 and 77 (processor
// time of 1920 x 1080, RGB in float32, lavapipe of Mesa 22.3.6, 2026-11-29).
#define LINE_RADIUS         64
#define LINE_SHORT_RADIUS   8
#define LINE_ROLLED_RADIUS  32
#define LINE_OUTPUTS        8
#define ROLLED_PIXELS       0x40000
#define ROLLED_OUTPUTS      128
#define STRIP_RADIUS        4
#define STRIP_COLUMNS       240
#define STRIP_ROWS          8
// Blocks of pixels that fill complete words, also with three channels. CHANNEL is the size of a
// channel in bytes. Of floats a window has 4 columns: with 2, `dual_kawase` takes 33 ms in place of 22
// and `unreal` 74 in place of 64 (1920 x 1080, lavapipe of Mesa 25.0.7, 2026-11-30). With 22.3.6 they
// take 26 and 24, and the same; but `jimenez2014` 19 in place of 21 (25.0.7: 27 and 20).
#define TAP_COLUMNS(CHANNEL)    ((CHANNEL) == 2 ? 8 : 4)
#define TAP_ROWS                32
#define TEXEL_COLUMNS(CHANNEL)  (16 / (CHANNEL))
#define TEXEL_ROWS              16
#define WINDOW_COLUMNS(CHANNEL) ((CHANNEL) == 1 ? 8 : 4)
#define WINDOW_ROWS             64
#define GATHER_COLUMNS          4
#define GATHER_ROWS             16
#define NINE_OUTPUTS            8
#define STREAK_COLUMNS          8
#define STREAK_ROWS             32
// Tiles of complete blooms: small ones, since with 32 rows `Separable` takes 0.184 ms in place of
// 0.126 (3840 x 2160 in float32, H100, 2026-11-27). Any device has their invocations and shared
// memory.
#define TILE_LOADED 64
#define TILE_ROWS   8
#define TILE_RUNS   2
#define TILE_RADIUS 16
// Tiles of filters have RUNS runs of rows; an invocation adds up a column of a run. A tile KEEPS
// the sums of rows of the source, of LINES of these if it has twice the tile's rows: windows of up
// to WINDOW texels of one kernel, in a simple ratio, where devices have SHARED bytes. An invocation
// keeps those of CHUNK columns, so that there are enough invocations for all.
#define FILTER_TILE_COLUMNS 32
#define FILTER_TILE_RUN     4
#define FILTER_TILE_RUNS    4
#define FILTER_TILE_LINES   32
#define FILTER_TILE_WINDOW  8
#define FILTER_TILE_SHARED  19000
#define FILTER_TILE_CHUNK(exact, exact_rows) \
    ((exact) == EXACT_DOUBLE && (exact_rows) == EXACT_DOUBLE ? 4 : 8)
#define FILTER_TILE_KEEPS(exact, kernels, width, height) \
    ((exact) != 0 && (kernels) == 1 && (width) > 1 && (height) > 1 \
     && (width) <= FILTER_TILE_WINDOW && (height) <= FILTER_TILE_WINDOW)
#define FILTER_TILE_ROWS(keeps, exact, window) \
    ((keeps) && (exact) == EXACT_HALF ? (FILTER_TILE_LINES - (window)) / 2 + 1 \
                                      : FILTER_TILE_RUN * FILTER_TILE_RUNS)

// Windows of the pixels of a target whose side is in a simple ratio to the source's: how far one is
// from that of the first pixel; its first texel, where it has an even number of texels if the sides
// differ; the texels of `count` adjacent ones.
#define WINDOW_OFFSET(exact, pixel) \
    ((exact) == EXACT_HALF ? 2 * (pixel) : (exact) == EXACT_SAME ? (pixel) : ((pixel) + 1) / 2)
#define WINDOW_FIRST(exact, pixel, window) \
    (WINDOW_OFFSET(exact, pixel) - ((exact) == EXACT_DOUBLE ? (window) : (window) - 1) / 2)
#define WINDOW_SPAN(exact, count, window) (WINDOW_OFFSET(exact, (count) - 1) + (window))

// Fourier transforms. FFT_INVOCATIONS is the size of a workgroup. In a transform of rows with fewer
// butterflies, FFT_ROW_COLUMNS of them are in one row. FFT_MAX_RADIX is the largest number of
// elements of a butterfly. With 64 of them a convolution of full size takes 1.7 times as long on a
// CPU, and its pipelines 0.8 seconds each. Values above FFT_LIMIT are clamped, since their sums
// would overflow.
#define FFT_INVOCATIONS 64
#define FFT_ROW_COLUMNS 8
#define FFT_MAX_RADIX   16
#define FFT_LIMIT             1e28
// In shared memory: the padding after `step` * `radix` elements of a line of `length`, where each of as
// many invocations stores `radix` elements `step` apart. It has them use different banks, of 32.
#define FFT_PADDING(step, radix, length) \
    ((step) * (radix) == (length) ? 0 \
     : (step) == 1                ? 1 - (radix) % 2 \
                                  : ((step) * (32 - (radix) % 32 + 1)) % 32)

// Products of spectra that one pass adds up.
#define MAX_PRODUCTS 3

// Adjoint passes: the pixels of a row of the table of weights, the root of the number of pixels
// that are added up at once, and how many of a line are, of those between two places of a grid.
#define TABLE_WIDTH 1024
#define SUM_SIDE    64
#define NODE_PIXELS 16
// Transposed filters in blocks: the texels along an axis whose weights are together in the table,
// and the rows of an invocation that writes words.
#define ADJOINT_SIDE 4
#define ADJOINT_ROWS 16

// Filament's taps of a level with even sides: their distance in texels, and the share of the outer
// ones along an axis.
#define FILAMENT_OFFSET 1.761629
#define FILAMENT_OUTER  (7.46602 / 32.0)

// Of a filter: the most taps along an axis, kernels, and texels of a window. The most pixels along
// an axis that read a texel in the tiles of a transpose, and pictures that these add up.
#define MAX_FILTER_TAPS 5
#define MAX_KERNELS     3
#define MAX_WINDOW      10
#define MAX_READERS     24
#define MAX_PICTURES    13

// The most levels that one pass adds up, and the most levels of a chain.
#define GATHERED_LEVELS 7
#define MAX_LEVELS      16

// The specialization constants of all shaders: CONSTANT(id, name in GLSL, name in C). Each is an
// int, and 0 if a pass does not set it. A flag is 1.
#define SPECIALIZATION_CONSTANTS(CONSTANT) \
    CONSTANT(0, SAMPLING, sampling)   /* how taps are filtered: SAMPLING_* */ \
    CONSTANT(1, COMPOSITE, composite) /* the formula: COMPOSITE_* */ \
    CONSTANT(2, TONEMAP, tonemap)     /* TONEMAP_* */ \
    CONSTANT(3, ENCODING, encoding)   /* ENCODING_* */ \
    CONSTANT(4, DITHER, dither)       /* noise is added before 8 bits */ \
    CONSTANT(5, LIT, lit)             /* the bloom contains the glare, and its intensity */ \
    CONSTANT(6, FORMAT, format)       /* how a fused pass rounds values that it keeps: STORED_* */ \
    CONSTANT(7, THRESHOLD_MODE, threshold_mode) /* THRESHOLD_* */ \
    CONSTANT(8, THRESHOLDED, thresholded)       /* a published method's threshold is applied */ \
    CONSTANT(9, POINT_BEFORE, before)           /* of samples before they are combined: POINT_* */ \
    CONSTANT(10, FIRST_LEVEL, first_level)      /* of HDRP's blurs: they make the first level */ \
    CONSTANT(11, DIRECTION, direction)          /* along which axis: DIRECTION_* */ \
    CONSTANT(12, RADIUS, radius)                /* texels of a half-kernel without its middle */ \
    CONSTANT(13, ADDS_IMAGE, adds_image)   /* what is at SLOT_SAME_SIZE, SLOT_BEFORE or SLOT_ADDED is added */ \
    CONSTANT(14, UPSAMPLE, upsample) /* what a tap samples: UPSAMPLE_* */ \
    CONSTANT(15, FROM_IMAGE, from_image) /* a variant reads the threshold pass's image */ \
    CONSTANT(16, EMITTERS, emitters)     /* how many passes add up in the target by blending */ \
    CONSTANT(17, PART_ABOVE, part_above) /* a streak or a flare reads what is above its threshold */ \
    CONSTANT(18, LEVELS, levels)         /* how many levels are added up */ \
    CONSTANT(19, TAP_SET, tap_set)       /* where a pass samples: TAPS_* */ \
    CONSTANT(20, COMBINE, combine)       /* what it makes of the samples: COMBINE_* */ \
    CONSTANT(21, ALPHA, alpha)           /* ALPHA_* */ \
    CONSTANT(22, MASKED, masked)         /* there is a mask */ \
    CONSTANT(23, STORED, stored)         /* the format of the target: STORED_* */ \
    CONSTANT(24, FIRST_SAMPLE, first_sample) /* of a transpose: its first kernel or tap */ \
    CONSTANT(25, STACKED_SAMPLES, stacked_samples) /* how many of these, below each other */ \
    CONSTANT(26, INVERSE, inverse)                 /* a transform is the way back */ \
    CONSTANT(27, ROTATED, rotated)                 /* a stage of a transform has factors */ \
    CONSTANT(28, PADDED, padded)                   /* a stage of a transform pads its lines */ \
    CONSTANT(29, STAGE, stage)                     /* of a transform: STAGE_* */ \
    CONSTANT(30, RADIX_1, radix_1)           /* elements of a stage, or of the first of a line */ \
    CONSTANT(31, RADIX_2, radix_2)           /* of the second; 1: there is none */ \
    CONSTANT(32, RADIX_3, radix_3)           /* of the third; 1: there is none */ \
    CONSTANT(33, RADIX_4, radix_4)           /* of the fourth; 1: there is none */ \
    CONSTANT(34, GROUP_WIDTH, group_width)   /* invocations of a workgroup: transforms, line.comp */ \
    CONSTANT(35, GROUP_HEIGHT, group_height) /* its rows of invocations */ \
    CONSTANT(36, ROLLED, rolled) /* of line.comp: the loop over a line's pixels stays one */ \
    CONSTANT(37, FINITE, finite) /* the source is known to have no NaN and no infinity */ \
    CONSTANT(38, UNROLLED_RADIUS, unrolled_radius) /* of line.comp: of unrolled loops; 0: any */ \
    CONSTANT(39, BY, by)                   /* of a transpose: what its result is of: BY_* */ \
    CONSTANT(40, BOUNDARY, boundary)       /* of what is PADDED: BOUNDARY_* */ \
    CONSTANT(41, PREFILTERED, prefiltered) /* of STAGE_FIRST: only bright colours */ \
    CONSTANT(42, ENLARGED, enlarged) /* a row of the source may have several of the target */ \
    CONSTANT(43, EXACT, exact) /* the ratio of both sides, or of the widths: EXACT_*; 0: none */ \
    CONSTANT(44, TAP_COUNT, tap_count)   /* taps of a filter along an axis, or of a streak */ \
    CONSTANT(45, KERNELS, kernels)       /* of a filter or its transpose */ \
    CONSTANT(46, WINDOW, window)         /* texels along an axis that a filter's taps may read */ \
    CONSTANT(47, MEAN_SIDE, mean_side)   /* texels of a block of which a sample is the mean */ \
    CONSTANT(48, EXACT_ROWS, exact_rows) /* the ratio of the heights: EXACT_*; 0: none */ \
    CONSTANT(49, TAKEN_X, taken_x)       /* bits of texels that have weights; 0: all */ \
    CONSTANT(50, TAKEN_Y, taken_y)       /* the same along y */ \
    CONSTANT(51, CLAMPED, clamped)       /* the bloom is not negative */ \
    CONSTANT(52, STREAK_TAP, streak_tap)       /* of a streak's transpose: its tap */ \
    CONSTANT(53, WINDOW_WIDTH, window_width)   /* of tiles: texels that a pixel adds up along x */ \
    CONSTANT(54, WINDOW_HEIGHT, window_height) /* the same along y */ \
    CONSTANT(55, PICTURES, pictures)           /* of tiles: pictures that are added up */ \
    CONSTANT(56, SPAN_WIDTH, span_width)       /* pixels along x that a block is read by */ \
    CONSTANT(57, SPAN_HEIGHT, span_height)     /* the same along y */ \
    CONSTANT(58, DISTANCE, distance)           /* of the pixels that a star mixes */ \
    CONSTANT(59, PLACED, placed)               /* the taps of a blur are at its `offsets` */ \
    CONSTANT(60, PARTIAL_SUMS, partial_sums)   /* of SUMMED_ROWS: adds up for another pass */ \
    CONSTANT(61, OF_SOURCE, of_source)         /* its cotangents are of an image that is given */ \
    CONSTANT(62, ABERRATED, aberrated)         /* red and blue of a flare are moved */ \
    CONSTANT(63, THROUGH_COMPOSITE, through_composite) /* a composite's cotangents are read */ \
    CONSTANT(64, POINT_AFTER, after)           /* of the combination: POINT_* */ \
    CONSTANT(65, EXPOSED_SCENE, exposed_scene) /* a composite's scene is exposed before it */ \
    CONSTANT(66, JITTERED, jittered)           /* samples of beams are between steps */ \
    CONSTANT(67, ENGINE, engine) /* of an exposure: EXPOSURE_*; of anti-aliasing: TAA_* */ \
    CONSTANT(68, METER, meter)                 /* what meter.frag makes: METER_* */ \
    CONSTANT(69, PRODUCTS, products)           /* of spectra, that are added up */ \
    CONSTANT(70, MOVING, moving)               /* how the motion is given: MOTION_*; 0: none */ \
    CONSTANT(71, DEEP, deep)                   /* there is an image of the depth */ \
    CONSTANT(72, WEIGHTED, weighted)           /* a stage of a transform multiplies by weights */ \
    CONSTANT(73, FILLED, filled)               /* elements of a line's first butterflies; others are 0 */ \
    CONSTANT(74, KEPT_RESULTS, kept_results)   /* of a line's last butterflies */ \
    CONSTANT(75, PITCH, pitch)                 /* floats of a line in shared memory */ \
    CONSTANT(76, CHANNELS, channels)           /* that complete lines are of */ \
    CONSTANT(77, INNER, inner)                 /* of PICTURES: a window's texels away from edges */ \
    CONSTANT(78, OF_POSITIVE, of_positive)     /* of ADDS_IMAGE: the scene's positive colours alone */

// The names that a setting can have. Each list is a setting and a specialization constant.
#define COMPOSITE_NAMES(NAME) \
    NAME(COMPOSITE_ADD, 0, add) \
    NAME(COMPOSITE_MIX, 1, mix) \
    NAME(COMPOSITE_SCREEN, 2, screen) \
    NAME(COMPOSITE_SOFT_LIGHT, 3, soft_light) \
    NAME(COMPOSITE_REPLACE, 4, replace)

#define TONEMAP_NAMES(NAME) \
    NAME(TONEMAP_NONE, 0, none) \
    NAME(TONEMAP_REINHARD, 1, reinhard) \
    NAME(TONEMAP_ACES, 2, aces) \
    NAME(TONEMAP_EXPONENTIAL, 3, exponential) \
    NAME(TONEMAP_KHRONOS_NEUTRAL, 4, khronos_neutral) \
    NAME(TONEMAP_AGX, 5, agx)

#define ENCODING_NAMES(NAME) \
    NAME(ENCODING_NONE, 0, none) \
    NAME(ENCODING_GAMMA22, 1, gamma22) \
    NAME(ENCODING_SRGB, 2, srgb) \
    NAME(ENCODING_PQ, 3, pq) \
    NAME(ENCODING_HLG, 4, hlg)

#define ALPHA_NAMES(NAME) \
    NAME(ALPHA_KEEP, 0, keep) \
    NAME(ALPHA_MAX, 1, max) \
    NAME(ALPHA_BLUR, 2, blur)

#define TEXEL_NAMES(NAME) \
    NAME(TEXEL_OWN, 0, own) \
    NAME(TEXEL_X, 1, x)

#define BOUNDARY_NAMES(NAME) \
    NAME(BOUNDARY_ZERO, 0, zero) \
    NAME(BOUNDARY_EDGE, 1, edge) \
    NAME(BOUNDARY_WRAP, 2, wrap) \
    NAME(BOUNDARY_WRAP_X, 3, wrap_x) \
    NAME(BOUNDARY_MIRROR, 4, mirror)

#define TYPE_NAMES(NAME) \
    NAME(TYPE_BLOOM, 0, bloom) \
    NAME(TYPE_GHOSTS, 1, ghosts) \
    NAME(TYPE_STREAKS, 2, streaks) \
    NAME(TYPE_FOG_GLOW, 3, fog_glow) \
    NAME(TYPE_SIMPLE_STAR, 4, simple_star) \
    NAME(TYPE_SUN_BEAMS, 5, sun_beams) \
    NAME(TYPE_KERNEL, 6, kernel)

#define QUALITY_NAMES(NAME) \
    NAME(QUALITY_HIGH, 0, high) \
    NAME(QUALITY_MEDIUM, 1, medium) \
    NAME(QUALITY_LOW, 2, low)

#define FILTER_NAMES(NAME) \
    NAME(FILTER_GAUSSIAN, 0, gaussian) \
    NAME(FILTER_KAWASE, 1, kawase) \
    NAME(FILTER_DUAL, 2, dual)

#define VARIANT_NAMES(NAME) \
    NAME(VARIANT_R185, 0, r185) \
    NAME(VARIANT_R187, 1, r187) \
    NAME(VARIANT_NODE, 2, node)

#define CHOICES(CHOICE) \
    CHOICE(variant, VARIANT_NAMES) \
    CHOICE(composite, COMPOSITE_NAMES) \
    CHOICE(tonemap, TONEMAP_NAMES) \
    CHOICE(encoding, ENCODING_NAMES) \
    CHOICE(alpha, ALPHA_NAMES) \
    CHOICE(texel, TEXEL_NAMES) \
    CHOICE(boundary, BOUNDARY_NAMES) \
    CHOICE(type, TYPE_NAMES) \
    CHOICE(quality, QUALITY_NAMES) \
    CHOICE(filter, FILTER_NAMES)

// Modes that the core chooses, with the same names in C and GLSL. 0 means that a pass has not set
// the constant, or THRESHOLD_NONE. COMPOSITE_* go on with those of COMPOSITE_NAMES.
#define MODE_NAMES(NAME) \
    NAME(COMPOSITE_OFF, -1, off) \
    NAME(COMPOSITE_ADD_TO_POSITIVE, 5, add_to_positive) \
    NAME(COMPOSITE_UNCLAMPED_SCREEN, 6, unclamped_screen) \
    NAME(COMPOSITE_LIGHTNESS_SCREEN, 7, lightness_screen) \
    NAME(THRESHOLD_NONE, 0, none) \
    NAME(THRESHOLD_HARD, 1, hard) \
    NAME(THRESHOLD_KNEE, 2, knee) \
    NAME(DIRECTION_VERTICAL, 1, vertical) \
    NAME(DIRECTION_HORIZONTAL, 2, horizontal) \
    NAME(DIRECTION_BOTH, 3, both) \
    NAME(SAMPLING_TEXEL, 1, texel) \
    NAME(SAMPLING_FILTER, 2, filter) \
    NAME(SAMPLING_FETCH, 3, fetch) \
    NAME(STORED_UNORM8, 1, unorm8) \
    NAME(STORED_HALF, 2, half) \
    NAME(STORED_SINGLE, 3, single) \
    NAME(STORED_UNORM8_SCALED, 4, unorm8_scaled) \
    NAME(STORED_UFLOAT, 5, ufloat) \
    NAME(STORED_SRGB8, 6, srgb8) \
    NAME(UPSAMPLE_TENT, 1, tent) \
    NAME(UPSAMPLE_LINEAR, 2, linear) \
    NAME(UPSAMPLE_CUBIC, 3, cubic) \
    NAME(UPSAMPLE_INSET_LINEAR, 4, inset_linear) \
    NAME(UPSAMPLE_INSET_CUBIC, 5, inset_cubic) \
    NAME(UPSAMPLE_CORNERS, 6, corners) \
    NAME(UPSAMPLE_INSIDE, 7, inside) \
    NAME(UPSAMPLE_LEFT_PAIR, 8, left_pair) \
    NAME(UPSAMPLE_RIGHT_PAIR, 9, right_pair) \
    NAME(EXACT_HALF, 1, exact_half) \
    NAME(EXACT_DOUBLE, 2, exact_double) \
    NAME(EXACT_SAME, 3, exact_same) \
    NAME(BY_SCENE, 1, by_scene) \
    NAME(BY_BLOOM, 2, by_bloom) \
    NAME(BY_MASK, 3, by_mask) \
    NAME(BY_VALUES, 4, by_values) \
    NAME(BY_MIXED, 5, by_mixed) \
    NAME(MOTION_PLANES, 1, planes) \
    NAME(MOTION_PACKED, 2, packed) \
    NAME(METER_LIGHT, 1, light) \
    NAME(METER_SUM, 2, sum) \
    NAME(METER_LEVEL, 3, level) \
    NAME(METER_SAMPLES, 4, samples) \
    NAME(METERING_SPOT, 1, spot) \
    NAME(METERING_CENTER, 2, center_weighted) \
    NAME(METERING_MASK, 3, metering_mask) \
    NAME(METERING_PROCEDURAL, 4, procedural) \
    NAME(STAGE_FIRST, 1, first_stage) \
    NAME(STAGE_PRODUCT, 2, product) \
    NAME(STAGE_LAST, 3, last_stage) \
    NAME(STAGE_GREY, 4, grey)

// What a pass with the block `prefilter` computes is a choice of four tables, whose rows C and GLSL
// expand: where it samples its source (TAP_SET), what it makes of the samples (COMBINE), and a
// function of each sample and one of the result (POINT_BEFORE, POINT_AFTER). All variants of the
// pass and its adjoint follow from the choice. Each function stands in GLSL, with its slope beside
// it.
//
// Sets of taps: SET(name, value, taps, kernels, place, share).
//
//   TAP(number, x, y)                   a sample, at numbers of places along both axes, from
//                                       -MAX_PLACE to MAX_PLACE; 0 is the pixel's position
//   KERNEL(number, share, a, b, c, d)   the mean of four taps: upper left, upper right, lower left,
//                                       lower right. Without kernels each tap is one, of which
//                                       there are at most MAX_SET_KERNELS.
//   place(at, part), share(at, part)    where the place with the number `at` is, at most MAX_PLACE
//                                       texels from the position, and its factor of the share of a
//                                       tap that is a kernel, for a position that is `part` of a
//                                       texel after one
//
// csrc/README.md has the limits of a new set.
#define CENTRE_TAPS(TAP) TAP(0, 0, 0)
#define CROSS_TAPS(TAP) \
    TAP(0, 0, 0) \
    TAP(1, -1, 0) \
    TAP(2, 1, 0) \
    TAP(3, 0, -1) \
    TAP(4, 0, 1)
#define CORNER_TAPS(TAP) \
    TAP(0, -1, -1) \
    TAP(1, 1, -1) \
    TAP(2, -1, 1) \
    TAP(3, 1, 1)
// Those of HDRP's prefilter (Unity-Technologies/Graphics,
// com.unity.render-pipelines.high-definition, BloomPrefilter.compute @ 2309d2c2fde8).
#define STAR_TAPS(TAP) \
    TAP(0, 0, 0) \
    TAP(1, 2, -1) \
    TAP(2, -2, 1) \
    TAP(3, 1, 2) \
    TAP(4, -1, -2)
// Nine in three rows, and four around the centre (Jimenez, "Next Generation Post Processing in Call
// of Duty: Advanced Warfare", SIGGRAPH 2014).
#define THIRTEEN_TAPS(TAP) \
    TAP(0, -2, -2) \
    TAP(1, 0, -2) \
    TAP(2, 2, -2) \
    TAP(3, -2, 0) \
    TAP(4, 0, 0) \
    TAP(5, 2, 0) \
    TAP(6, -2, 2) \
    TAP(7, 0, 2) \
    TAP(8, 2, 2) \
    TAP(9, -1, -1) \
    TAP(10, 1, -1) \
    TAP(11, -1, 1) \
    TAP(12, 1, 1)
#define THIRTEEN_KERNELS(KERNEL) \
    KERNEL(0, 0.5, 9, 10, 11, 12) \
    KERNEL(1, 0.125, 0, 1, 3, 4) \
    KERNEL(2, 0.125, 1, 2, 4, 5) \
    KERNEL(3, 0.125, 3, 4, 6, 7) \
    KERNEL(4, 0.125, 4, 5, 7, 8)
#define NO_KERNELS(KERNEL)

#define TEXEL_PLACE(at, part) (at)
#define TEXEL_SHARE(at, part) 1.0
#define STAR_PLACE(at, part) \
    ((at) == 0 ? 0.0 : (at) == 1 ? 0.4 : (at) == -1 ? -0.4 : (at) == 2 ? 0.9 : -0.9)
// Filament's: along an axis the texels at -1 .. 2 have the weights (1 - f, 2 - f, 1 + f, f) / 4,
// which are linear samples of a filter with PAIR_SIDE on both sides. Two samples, each between two
// texels, give these weights.
#define PAIR_SIDE 0.25
#define PAIR_PLACE(at, part) \
    ((at) < 0 ? (2.0 - (part)) / (3.0 - 2.0 * (part)) - 1.0 - (part) \
              : 1.0 + (part) / (1.0 + 2.0 * (part)) - (part))
#define PAIR_SHARE(at, part) \
    ((at) < 0 ? PAIR_SIDE * (3.0 - 2.0 * (part)) : PAIR_SIDE * (1.0 + 2.0 * (part)))

#define TAP_SETS(SET) \
    SET(TAPS_CENTRE, 1, CENTRE_TAPS, NO_KERNELS, TEXEL_PLACE, TEXEL_SHARE) \
    SET(TAPS_CROSS, 2, CROSS_TAPS, NO_KERNELS, TEXEL_PLACE, TEXEL_SHARE) \
    SET(TAPS_CORNERS, 3, CORNER_TAPS, NO_KERNELS, TEXEL_PLACE, TEXEL_SHARE) \
    SET(TAPS_PAIRS, 4, CORNER_TAPS, NO_KERNELS, PAIR_PLACE, PAIR_SHARE) \
    SET(TAPS_STAR, 5, STAR_TAPS, NO_KERNELS, STAR_PLACE, TEXEL_SHARE) \
    SET(TAPS_THIRTEEN, 6, THIRTEEN_TAPS, THIRTEEN_KERNELS, TEXEL_PLACE, TEXEL_SHARE)

// Nine taps along one axis, pixels of the target apart (nine.frag): LINE(name, value, half-kernel).
// Values are those of TAP_SETS, continued: one constant has the number of either kind of set.
// HDRP's is a binomial of order 8.
#define GODOT_NINE 0.2024, 0.1790, 0.1240, 0.0672, 0.0285
#define HDRP_NINE  0.2734375, 0.21875, 0.109375, 0.03125, 0.00390625
#define LINE_SETS(LINE) \
    LINE(TAPS_GODOT, 7, GODOT_NINE) \
    LINE(TAPS_HDRP, 8, HDRP_NINE)

// The most taps and kernels of a set, and the largest number of a place.
#define MAX_SET_TAPS    13
#define MAX_SET_KERNELS 5
#define MAX_PLACE       2

// What becomes of the kernels of a set, by functions of lib/combine.glsl:
//
//   AVERAGE(name, value, weight)   their average with weights, which depend on kernel and share
//   SUM(name, value, weight)       the same, not divided by the weights
//   WITHIN(name, value, weight)    the mean, by shares, of kernels of four taps, whose taps are
//                                  averaged
//   SELECT(name, value, function)  another function of them
#define COMBINATIONS(AVERAGE, SUM, WITHIN, SELECT) \
    AVERAGE(COMBINE_MEAN, 1, share_weight) \
    AVERAGE(COMBINE_KARIS, 2, karis_weight) \
    AVERAGE(COMBINE_KARIS_HDRP, 3, hdrp_weight) \
    AVERAGE(COMBINE_KARIS_PYGFX, 4, pygfx_weight) \
    AVERAGE(COMBINE_BRIGHTEST, 5, brightest_weight) \
    SUM(COMBINE_KARIS_BEVY, 6, bevy_weight) \
    WITHIN(COMBINE_BLENDER, 7, blender_weight) \
    SELECT(COMBINE_MEDIAN, 8, median)

// Functions of a value: POINT(name, value, function), in lib/points.glsl, where `back_` and the
// name is the slope. THRESHOLD_POINTS are thresholds with slopes by what they read (SUMS), too.
#define POINTS(POINT) \
    POINT(POINT_CAPPED, 1, capped) \
    POINT(POINT_FINITE, 2, finite) \
    POINT(POINT_TINTED, 3, tinted) \
    POINT(POINT_LIGHTNESS, 6, bright_lightness) \
    POINT(POINT_BABYLON, 14, babylon) \
    POINT(POINT_DIMMED, 15, dimmed) \
    THRESHOLD_POINTS(POINT)
#define THRESHOLD_POINTS(POINT) \
    POINT(POINT_ROLLED, 4, rolled) \
    POINT(POINT_HIGHLIGHTS, 5, highlights) \
    POINT(POINT_BEVY, 7, bevy) \
    POINT(POINT_KINO, 8, kino) \
    POINT(POINT_URP, 9, urp) \
    POINT(POINT_PPV2, 10, ppv2) \
    POINT(POINT_THREE, 11, three) \
    POINT(POINT_THREE_NODE, 12, three_node) \
    POINT(POINT_UNREAL, 13, unreal) \
    POINT(POINT_GLOWING, 16, glowing)
#define POINT_NONE 0

// The choices of the blooms: PREFILTER(name, taps, combine, before, after).
#define PREFILTERS(PREFILTER) \
    PREFILTER(pyramid, TAPS_THIRTEEN, COMBINE_KARIS, POINT_NONE, POINT_NONE) \
    PREFILTER(bevy, TAPS_THIRTEEN, COMBINE_KARIS_BEVY, POINT_NONE, POINT_BEVY) \
    PREFILTER(pygfx, TAPS_THIRTEEN, COMBINE_MEAN, POINT_NONE, POINT_FINITE) \
    PREFILTER(pygfx_karis, TAPS_THIRTEEN, COMBINE_KARIS_PYGFX, POINT_NONE, POINT_FINITE) \
    PREFILTER(blender, TAPS_THIRTEEN, COMBINE_BLENDER, POINT_NONE, POINT_FINITE) \
    PREFILTER(highlights, TAPS_CENTRE, COMBINE_MEAN, POINT_NONE, POINT_HIGHLIGHTS) \
    PREFILTER(kino, TAPS_CENTRE, COMBINE_MEAN, POINT_CAPPED, POINT_KINO) \
    PREFILTER(kino_median, TAPS_CROSS, COMBINE_MEDIAN, POINT_CAPPED, POINT_KINO) \
    PREFILTER(kino_level, TAPS_CORNERS, COMBINE_BRIGHTEST, POINT_NONE, POINT_NONE) \
    PREFILTER(filament, TAPS_PAIRS, COMBINE_MEAN, POINT_NONE, POINT_NONE) \
    PREFILTER(filament_bright, TAPS_PAIRS, COMBINE_BRIGHTEST, POINT_NONE, POINT_ROLLED) \
    PREFILTER(hdrp, TAPS_STAR, COMBINE_KARIS_HDRP, POINT_NONE, POINT_NONE) \
    PREFILTER(hdrp_level, TAPS_HDRP, COMBINE_MEAN, POINT_NONE, POINT_NONE) \
    PREFILTER(godot_across, TAPS_GODOT, COMBINE_MEAN, POINT_DIMMED, POINT_NONE) \
    PREFILTER(godot_down, TAPS_GODOT, COMBINE_MEAN, POINT_NONE, POINT_GLOWING) \
    PREFILTER(godot_level, TAPS_GODOT, COMBINE_MEAN, POINT_NONE, POINT_NONE) \
    PREFILTER(urp, TAPS_CENTRE, COMBINE_MEAN, POINT_CAPPED, POINT_URP) \
    PREFILTER(post_processing, TAPS_CENTRE, COMBINE_MEAN, POINT_CAPPED, POINT_PPV2) \
    PREFILTER(tint, TAPS_CENTRE, COMBINE_MEAN, POINT_NONE, POINT_TINTED) \
    PREFILTER(three, TAPS_CENTRE, COMBINE_MEAN, POINT_NONE, POINT_THREE) \
    PREFILTER(three_node, TAPS_CENTRE, COMBINE_MEAN, POINT_NONE, POINT_THREE_NODE) \
    PREFILTER(unreal, TAPS_CENTRE, COMBINE_MEAN, POINT_NONE, POINT_UNREAL) \
    PREFILTER(babylon, TAPS_CENTRE, COMBINE_MEAN, POINT_NONE, POINT_BABYLON) \
    PREFILTER(darktable, TAPS_CENTRE, COMBINE_MEAN, POINT_NONE, POINT_LIGHTNESS)
