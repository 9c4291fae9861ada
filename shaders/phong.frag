#version 450
// The lit mesh: one light fixed in view space (figures: the forward system's Phong pass).

layout(location = 0) in vec3 view_position;
layout(location = 1) in vec3 view_normal;
layout(location = 2) in vec3 vertex_colour;
layout(location = 0) out vec4 colour;

const vec3 LIGHT_POSITION = vec3(-5.0, -5.0, 0.0);
// Colours with a channel this bright count as lamps and get ambient light.
const float LAMP = 0.9;

void main()
{
    vec3 n = normalize(view_normal);
    vec3 l = normalize(LIGHT_POSITION - view_position);
    vec3 v = normalize(-view_position);
    vec3 r = reflect(-l, n);
    vec3 ambient = any(greaterThanEqual(vertex_colour, vec3(LAMP))) ? vertex_colour * 0.25
                                                                    : vec3(0.0);
    vec3 diffuse = max(dot(n, l), 0.0) * vertex_colour;
    vec3 specular = vec3(pow(max(dot(r, v), 0.0), 8.0) * 0.75);
    colour = vec4(ambient + diffuse + specular, 1.0);
}
