// The end of Blender's glare (blender_end.frag) if it has the size of the bloom. As a fragment shader it takes
// 28 ms in place of 8 (processor time of 1920 x 1080, lavapipe of Mesa 22.3.6, 2026-11-29).

UNIFORM_BLOCK(BLENDER_END_BLOCK);
#include "lib/saturated.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = TEXEL_COLUMNS(CHANNEL_BYTES), ROWS = TEXEL_ROWS, LOADED = COLUMNS;
#include "variants/runs.glsl"

void write_row(int x, int y)
{
    uvec4 raw[COLUMNS];

    load_run(x, y, raw);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        vec4 value = value_of(raw[i]);
        raw[i] = raw_of(stored(vec4(saturated(value.rgb), value.a) * params.factors[0]));
    }
    store(x, y, raw);
}

#include "variants/rows.glsl"
