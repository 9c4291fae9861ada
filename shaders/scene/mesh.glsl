// A mesh in view space, for the glow, the Phong and the G-buffer passes.
#include "lib/block.glsl"

UNIFORM_BLOCK(MESH_BLOCK);

// The fourth components are the emission.
layout(location = 0) in vec4 position;
layout(location = 1) in vec4 normal;
layout(location = 2) in vec4 colour;

#define VARYING out
#include "scene/varyings.glsl"

void write_vertex()
{
    mat3x4 model_view = mat3x4(params.model_view[0], params.model_view[1], params.model_view[2]);
    vec4 projection = params.projection[0];
    view_position = vec4(position.xyz, 1.0) * model_view;
    view_normal = vec4(normal.xyz, 0.0) * model_view;
    vertex_colour = colour.rgb;
    emission_red = position.w;
    emission_green = normal.w;
    emission_blue = colour.w;
    gl_Position = vec4(view_position * projection.xyz + vec3(0.0, 0.0, projection.w),
                       -view_position.z);
}
