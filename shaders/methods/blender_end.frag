// The end of Blender's glare: enlarged, with another saturation, tinted (formulas of the compositor of
// Blender 5.0 and 5.2).
#include "lib/sampling.glsl"

UNIFORM_BLOCK(BLENDER_END_BLOCK);

layout(set = 0, binding = 1) uniform sampler2D source;

#include "lib/fullscreen.glsl"

// The saturation (max - min) / max is multiplied, and is then 0 to 1.
vec3 saturated(vec3 value)
{
    float most = max(value.r, max(value.g, value.b)), least = min(value.r, min(value.g, value.b));
    float spread = most - least;
    if (most <= 0.0 || spread == 0.0)
        return vec3(most);
    float wanted = min(params.saturation * (spread / most), 1.0);
    return most * (1.0 - wanted) + (value - least) * (wanted * most / spread);
}

vec4 shade()
{
    Place place = PLACE_IN(source);
    if (params.reads_next != 0)
        place.texel = next_texel(source, place.texel, params.next[0]);
    vec4 value = fetch_bilinear(source, place.texel, place.part);
    return stored(vec4(saturated(value.rgb), value.a) * params.factors[0]);
}
