// Large images by bands of rows. A graph can run in three parts if its first smaller image depends
// only on rows of the source, and its result only on rows of the source and on a few smaller
// images:
// 1. Bands of the source become the first smaller image.
// 2. The first smaller image becomes the others.
// 3. The smaller images and bands of the source become bands of the result.
// Only the smaller images are complete in memory.
#ifndef VKB_BANDS_H
#define VKB_BANDS_H

#include "graph/graph.h"

struct vkb_bands {
    uint32_t head;                     // the first smaller image; VKB_NO_IMAGE: there is none
    uint32_t levels[GATHERED_LEVELS];  // the smaller images that the result depends on
    uint32_t level_count;
    uint32_t step;   // bands start and end at multiples of this, in rows
    uint32_t reach;  // rows beyond a band that it may depend on
};

// Finds the parts of a graph whose source has `height` rows. False if it has no such parts.
bool vkb_graph_bands(const struct vkb_graph *graph, uint32_t output, uint32_t height,
                     struct vkb_bands *bands);

typedef char vkb_image_name[VKB_NAME_SIZE];

// A part of a graph, by the names of images.
struct vkb_part {
    vkb_image_name outputs[GATHERED_LEVELS];  // become framebuffers
    vkb_image_name levels[GATHERED_LEVELS];   // become inputs
    uint32_t output_count, level_count;
    uint32_t height;       // of the source
    uint32_t first, rows;  // of a band of it: the other images have their share; rows 0: no bands
};

// Removes the images and passes that the part does not need.
bool vkb_graph_take(struct vkb_graph *graph, const struct vkb_part *part, struct vkb_error *error);

#endif
