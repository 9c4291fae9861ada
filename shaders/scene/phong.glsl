// One light at a fixed position in view space; the values are those of the forward system's Phong
// pass. All vectors are in view space, and the normal has length 1.

const vec3 LIGHT_POSITION = vec3(-5.0, -5.0, 0.0);
// A colour with a channel of at least 0.9 is a lamp, and gets ambient light. The limit is the half
// float nearest to 0.9: the G-buffer holds this value for 0.9, and an interpolated 0.9 may be lower
// by the rounding of the interpolation.
const float LAMP = 0.89990234375;

vec3 phong(vec3 colour, vec3 n, vec3 position)
{
    vec3 l = normalize(LIGHT_POSITION - position);
    vec3 v = normalize(-position);
    vec3 r = reflect(-l, n);
    vec3 ambient = any(greaterThanEqual(colour, vec3(LAMP))) ? colour * 0.25 : vec3(0.0);
    vec3 diffuse = max(dot(n, l), 0.0) * colour;
    vec3 specular = vec3(pow(max(dot(r, v), 0.0), 8.0) * 0.75);
    return ambient + diffuse + specular;
}
