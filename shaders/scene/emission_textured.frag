#version 450
#extension GL_GOOGLE_include_directive : require
// Triangles of the body with textures, as what glows.
#define EMISSION
#define TEXTURED
#include "scene/glow_mesh.glsl"
