// The motion that temporal anti-aliasing keeps for the next frame. The last channel is 1.
#include "lib/taa.glsl"

vec4 shade()
{
    return vec4(motion_at(PIXEL), 0.0, 1.0);
}
