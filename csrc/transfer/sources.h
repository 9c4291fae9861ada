// How the pixels of a source become the images that passes read.
#ifndef VKB_SOURCES_H
#define VKB_SOURCES_H

#include "execute/record.h"

// The ways are rows of a table, and the first one that suits an input is taken: what a call before
// has made; an image that stays on the device; memory that CUDA shares; the caller's memory, read
// in place; an upload. The source is read before vkb_sources_stage returns, except in place.
bool vkb_sources_stage(struct vkb_run *run, const struct vkb_frame_source *source,
                       const struct vkb_request *requests, uint32_t request_count,
                       struct vkb_error *error);

// Records the copies that the device has to make.
bool vkb_sources_record(struct vkb_run *run, struct vkb_error *error);

// After the submission, or the failure of one.
void vkb_sources_end(struct vkb_run *run, bool submitted);

// The version of the scene, or of the input that was written last.
uint64_t vkb_sources_version(const struct vkb_run *run);

// Sets the image of the graph's row; NULL: there is none yet.
void vkb_run_set_image(struct vkb_run *run, uint32_t image, struct vkb_cached_image *cached);

// The row of the graph's image, used as all requests of the submission need it.
struct vkb_image_row vkb_run_row(const struct vkb_run *run, uint32_t image);

// Finds or creates the cached image of the graph's image. A cached image that does not fit is
// replaced only after all pending commands, which may use it. The requests of one submission have
// the same images.
bool vkb_run_resolve(struct vkb_run *run, uint32_t image, struct vkb_error *error);

#endif
