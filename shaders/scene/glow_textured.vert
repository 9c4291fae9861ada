#version 450
#extension GL_GOOGLE_include_directive : require
// Triangles of the glow mesh with textures.
#define GLOW
#define TEXTURED
#include "scene/mesh.glsl"
