// The colour attachments of the G-buffer pass. A normal of length 0 marks an unlit pixel: its colour
// is its albedo.

layout(location = 0) out vec4 albedo;
layout(location = 1) out vec4 normal;
layout(location = 2) out vec4 position;
layout(location = 3) out vec4 brightness;

// Blending does not clamp, so each added emitter is clamped to its part of the range.
vec3 clamp_to_part(vec3 light)
{
    const float most = HALF_LIMIT / float(EMITTERS);
    return clamp(light, -most, most);
}
