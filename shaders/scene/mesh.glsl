// A mesh in view space, for the glow, the Phong and the G-buffer passes.
#include "lib/block.glsl"

UNIFORM_BLOCK(MESH_BLOCK);

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 colour;
layout(location = 3) in vec3 emission;

layout(location = 0) out vec3 view_position;
layout(location = 1) out vec3 view_normal;
layout(location = 2) out vec3 vertex_colour;
layout(location = 3) out vec3 vertex_emission;

void write_vertex()
{
    mat4 projection = mat4(params.projection[0], params.projection[1], params.projection[2],
                           params.projection[3]);
    mat4 view = mat4(params.view[0], params.view[1], params.view[2], params.view[3]);
    mat4 model = mat4(params.model[0], params.model[1], params.model[2], params.model[3]);
    mat4 model_view = view * model;
    vec4 in_view = model_view * vec4(position, 1.0);
    view_position = in_view.xyz;
    view_normal = mat3(model_view) * normal;
    vertex_colour = colour;
    vertex_emission = emission;
    gl_Position = projection * in_view;
}
