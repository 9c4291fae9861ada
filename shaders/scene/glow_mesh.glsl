// The glow mesh: its unlit colour times the intensity, after the threshold if there is one.
#define GLOW
#include "lib/block.glsl"
#include "scene/surface.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(MESH_BLOCK);
#include "lib/storage.glsl"

layout(location = 0) out vec4 colour;

void main()
{
    vec3 kept = apply_threshold(surface_colour() * params.glow_intensity, THRESHOLD_MODE,
                                  params.threshold, params.knee);
    colour = vec4(storable(kept), 1.0);
}
