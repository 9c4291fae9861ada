// Adds the glow mesh's light to the brightness by blending. Adding 0 keeps the other attachments.
#include "scene/gbuffer.glsl"

SAMPLED_IMAGE(SLOT_SOURCE, glow);

void main()
{
    albedo = vec4(0.0);
    normal = vec4(0.0);
    position = vec4(0.0);
    brightness = vec4(clamp_to_part(texelFetch(glow, ivec2(gl_FragCoord.xy), 0).rgb), 0.0);
}
