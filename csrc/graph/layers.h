// A batch as a graph: its images have a layer for each image of the batch, and one dispatch writes
// all layers of its target.
#ifndef VKB_LAYERS_H
#define VKB_LAYERS_H

#include "graph/graph.h"

// Gives all images of the graph that many layers. Its shaders are replaced by others that work on
// the layer with the number of their workgroup along z. A VALUE error where this cannot be done: of
// draws, of words, and of images that the host fills for all frames.
bool vkb_graph_layer(struct vkb_graph *graph, uint32_t layers, struct vkb_error *error);

#endif
