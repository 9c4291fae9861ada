// What the vertex shader of a mesh hands on, in view space. VARYING is `in` or `out`. The glow (GLOW) has
// only colours. The emission is in the fourth components, since llvmpipe compiles the same code for a
// location with three of them.

layout(location = 0) VARYING vec3 vertex_colour;
#ifdef TEXTURED
layout(location = 1) VARYING vec4 surface_texcoords;
#endif
#ifndef GLOW
layout(location = 0, component = 3) VARYING float emission_red;
layout(location = 2) VARYING vec3 view_position;
layout(location = 2, component = 3) VARYING float emission_green;
layout(location = 3) VARYING vec3 view_normal;
layout(location = 3, component = 3) VARYING float emission_blue;
#endif
