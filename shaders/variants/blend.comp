// The composite for a scene and a bloom that have the size and format of the result. As a fragment shader a change of
// the exposure takes 21 ms in place of 11, with Mesa 25.0.7 19 in place of 11 (processor time of a call, 1920 x 1080 in
// float16, lavapipe of Mesa 22.3.6, 2026-11-28).

UNIFORM_BLOCK(COMPOSITE_BLOCK);
#include "lib/composite.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = TEXEL_COLUMNS(CHANNEL_BYTES), ROWS = TEXEL_ROWS;

READ_IMAGE(SLOT_SCENE, scene);
READ_IMAGE(SLOT_BLOOM, bloom);

#define LOAD load_scene
#define LOAD_IMAGE scene
#define LOAD_SLOT SLOT_SCENE
#define LOAD_CHANNELS SOURCE_CHANNELS
#include "variants/load.glsl"

#include "variants/store.glsl"

void write_row(int x, int y)
{
    uvec4 raw[COLUMNS];

    load_scene(x, y, raw);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        vec4 light = value_of(raw_in_run(bloom, read_shapes[SLOT_BLOOM], x, i, y));
        vec4 sum = finish(value_of(raw[i]), light, 1.0, ivec2(x + i, y));
        raw[i] = finished(raw[i], sum);
    }
    store(x, y, raw);
}

#include "variants/rows.glsl"
