// The motion of a G-buffer's surfaces: now minus before, in shares of the sides, and the depth as the engine of the
// anti-aliasing has it. The background is still, and far away.

UNIFORM_BLOCK(MESH_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, position);

#define TAA_CONSTANT(name, value, spelling, shader) const int name = value;
TAAS(TAA_CONSTANT)

#include "lib/fullscreen.glsl"

vec2 project(vec3 at)
{
    return at.xy * params.projection[0].xy / max(-at.z, 1e-6);
}

vec4 shade()
{
    vec3 now = texelFetch(position, PIXEL, 0).xyz;
    bool reversed = ENGINE != TAA_GODOT && ENGINE != TAA_O3DE;
    if (now.z >= 0.0)
        return vec4(0.0, 0.0, reversed ? 0.0 : 1.0, 1.0);
    vec3 last = vec4(now, 1.0) * mat3x4(params.before[0], params.before[1], params.before[2]);
    float depth = (now.z * params.projection[0].z + params.projection[0].w) / -now.z;
    return vec4(0.5 * (project(now) - project(last)), reversed ? 1.0 - depth : depth, 1.0);
}
