// The sky behind everything: one triangle that covers the target, with the direction of each point.

UNIFORM_BLOCK(MESH_BLOCK);

layout(location = 0) out vec3 direction;

void main()
{
    vec2 corner = vec2((gl_VertexIndex << 1) & 2, gl_VertexIndex & 2) * 2.0 - 1.0;
    direction = params.sky[0].xyz + corner.x * params.sky[1].xyz + corner.y * params.sky[2].xyz;
    gl_Position = vec4(corner, 1.0, 1.0);
}
