// The sky behind everything: one triangle that covers the target, with the direction of each point.

UNIFORM_BLOCK(MESH_BLOCK);

layout(location = 0) out vec3 direction;

void main()
{
    vec2 corner = vec2((gl_VertexIndex << 1) & 2, gl_VertexIndex & 2) * 2.0 - 1.0;
    vec2 place = corner - params.jitter[0].xy;
    direction = params.sky[0].xyz + place.x * params.sky[1].xyz + place.y * params.sky[2].xyz;
    gl_Position = vec4(corner, 1.0, 1.0);
}
