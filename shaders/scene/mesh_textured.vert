#version 450
#extension GL_GOOGLE_include_directive : require
// Triangles with textures.
#include "scene/mesh.glsl"

layout(location = 4) in vec4 texcoords;
layout(location = 4) out vec4 places;

void main()
{
    write_vertex();
    places = texcoords;
}
