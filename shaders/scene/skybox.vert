#version 450
#extension GL_GOOGLE_include_directive : require
// A cube around the camera, computed from the vertex index. Only its inside is drawn.
#include "lib/block.glsl"

UNIFORM_BLOCK(MESH_BLOCK);

layout(location = 0) out vec3 direction;

// Two triangles for each side, counter-clockwise from outside in the renderer's y-down space.
const vec2 CORNERS[6] = vec2[](vec2(-1, -1), vec2(1, -1), vec2(1, 1),
                               vec2(-1, -1), vec2(1, 1), vec2(-1, 1));

vec3 cube_vertex(int index)
{
    vec2 corner = CORNERS[index % 6];
    int side = index / 6;
    float towards = (side & 1) == 0 ? 1.0 : -1.0;
    // Mirror the second coordinate with the side, so that opposite sides have the same winding.
    vec3 vertex = vec3(corner.x, corner.y * -towards, towards);
    int axis = side >> 1;
    return axis == 0 ? vertex.zxy : axis == 1 ? vertex.yzx : vertex.xyz;
}

void main()
{
    mat4 projection = mat4(params.projection[0], params.projection[1], params.projection[2],
                           params.projection[3]);
    mat3 rotation = mat3(params.view[0].xyz, params.view[1].xyz, params.view[2].xyz);
    direction = cube_vertex(gl_VertexIndex) * 5.0;
    gl_Position = projection * vec4(rotation * direction, 1.0);
    // The sky is never clipped: whatever planes the camera has, the cube uses those of the original
    // camera, which contain it.
    const float NEAR = 0.1, FAR = 256.0;
    gl_Position.z = (gl_Position.w - NEAR) * (FAR / (FAR - NEAR));
}
