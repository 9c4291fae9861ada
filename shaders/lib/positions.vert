// The triangle of fullscreen.vert for the shaders of others, whose inputs at the first locations are
// the position in the target, 0 to 1 from the upper left corner: engines hand it on under several
// names.

layout(location = 0) out vec4 positions[4];

void main()
{
    vec2 corner = vec2((gl_VertexIndex << 1) & 2, gl_VertexIndex & 2);
    for (int i = 0; i < 4; ++i)
        positions[i] = corner.xyxy;
    gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}
