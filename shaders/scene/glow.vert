#version 450
#extension GL_GOOGLE_include_directive : require
// Triangles of the glow mesh without textures.
#define GLOW
#include "scene/mesh.glsl"
