#version 450
#extension GL_GOOGLE_include_directive : require
// Triangles of the body without textures, as what glows.
#define EMISSION
#include "scene/glow_mesh.glsl"
