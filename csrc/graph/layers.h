// A batch as a graph: its images have a layer for each image of the batch, and one dispatch writes
// all layers of its target.
#ifndef VKB_LAYERS_H
#define VKB_LAYERS_H

#include "graph/graph.h"

// Makes the shader that works on the layer with the number of its workgroup along z; the caller
// frees its code with vkb_free. A VALUE error where there is none.
bool vkb_layer_shader(const struct vkb_shader *shader, struct vkb_shader *made,
                      struct vkb_error *error);

// Gives all images of the graph as many layers as it has. Its shaders are replaced by those of
// vkb_layer_shader. A VALUE error where this cannot be done: of
// draws, of words, and of images that the host fills for all frames.
bool vkb_graph_layer(struct vkb_graph *graph, struct vkb_error *error);

#endif
