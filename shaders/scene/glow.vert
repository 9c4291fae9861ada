// The glow mesh.
#define GLOW
#include "scene/mesh.vert"
