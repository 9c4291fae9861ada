#version 450
#extension GL_GOOGLE_include_directive : require
// Triangles without textures.
#include "scene/lit_mesh.glsl"
