#version 450
#extension GL_GOOGLE_include_directive : require
// Triangles with textures.
#define TEXTURED
#include "scene/mesh.glsl"
