#version 450
#extension GL_GOOGLE_include_directive : require
// Triangles with textures.
#include "scene/mesh.glsl"

layout(location = 3) in vec4 texcoords;
layout(location = 3) out vec4 surface_texcoords;

void main()
{
    write_vertex();
    surface_texcoords = texcoords;
}
