// A mesh in view space, for the glow (GLOW), the Phong and the G-buffer passes.

UNIFORM_BLOCK(MESH_BLOCK);

// The fourth components are the emission.
layout(location = 0) in vec4 position;
layout(location = 1) in vec4 normal;
layout(location = 2) in vec4 colour;
#ifdef TEXTURED
layout(location = 3) in vec4 texcoords;
#endif

#define VARYING out
#include "scene/varyings.glsl"

void main()
{
    mat3x4 model_view = mat3x4(params.model_view[0], params.model_view[1], params.model_view[2]);
    vec4 projection = params.projection[0];
    vec3 in_view = vec4(position.xyz, 1.0) * model_view;
    gl_Position = vec4(in_view * projection.xyz + vec3(0.0, 0.0, projection.w), -in_view.z);
    gl_Position.xy += params.jitter[0].xy * gl_Position.w;
    vertex_colour = colour.rgb;
#ifdef TEXTURED
    surface_texcoords = texcoords;
#endif
#ifndef GLOW
    view_position = in_view;
    view_normal = vec4(normal.xyz, 0.0) * model_view;
    emission_red = position.w;
    emission_green = normal.w;
    emission_blue = colour.w;
#endif
}
