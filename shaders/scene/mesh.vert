#version 450
#extension GL_GOOGLE_include_directive : require
// Triangles without textures.
#include "scene/mesh.glsl"
