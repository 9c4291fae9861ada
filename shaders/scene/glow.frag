// What glows, after the threshold if there is one: the glow mesh's unlit colour times the intensity, or,
// with EMISSION, the emission of the body.
#ifndef EMISSION
#define GLOW
#endif
#include "scene/surface.glsl"

UNIFORM_BLOCK(MESH_BLOCK);

layout(location = 0) out vec4 colour;

void main()
{
#ifdef EMISSION
    vec3 light = surface_emission();
#else
    vec3 light = surface_colour() * params.glow_intensity;
#endif
    vec3 kept = apply_threshold(light, THRESHOLD_MODE, params.threshold, params.knee);
    colour = vec4(storable(kept), 1.0);
}
