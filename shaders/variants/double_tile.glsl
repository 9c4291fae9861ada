// Upsampling to exactly twice the size for GPUs. A workgroup loads each texel of its tile once, into
// shared memory. The including shader defines: `smaller` and `target`; `own`, an image of the target's
// size (HAS_OWN: whether it is read); and shade(), which computes a pixel from the pixel of `own` and the
// upsampled sum.
#include "lib/doubling.glsl"

const int RUN = DOUBLE_TILE_ROWS / DOUBLE_TILE_RUNS;
const int INVOCATIONS = DOUBLE_TILE_COLUMNS * DOUBLE_TILE_RUNS;
// A pixel at an odd position starts one texel later.
const int LOADED_COLUMNS = DOUBLE_TILE_COLUMNS / 2 + 4, LOADED_ROWS = DOUBLE_TILE_ROWS / 2 + 4;
const int LOADED = LOADED_COLUMNS * LOADED_ROWS;

layout(local_size_x = DOUBLE_TILE_COLUMNS, local_size_y = DOUBLE_TILE_RUNS) in;

shared vec4 tile[LOADED_ROWS][LOADED_COLUMNS];

void load_tile(ivec2 first)
{
    ivec2 last = textureSize(smaller, 0) - 1;
    [[unroll]] for (int i = 0; i < LOADED; i += INVOCATIONS) {
        int at = i + int(gl_LocalInvocationIndex);
        ivec2 place = ivec2(at % LOADED_COLUMNS, at / LOADED_COLUMNS);
        if (at < LOADED)
            tile[place.y][place.x] =
                texelFetch(smaller, clamp(first + place, ivec2(0), last), 0);
    }
}

void main()
{
    ivec2 first = ivec2(gl_WorkGroupID.xy) * ivec2(DOUBLE_TILE_COLUMNS, DOUBLE_TILE_ROWS);
    int column = int(gl_LocalInvocationID.x), top = RUN * int(gl_LocalInvocationID.y);
    ivec2 size = imageSize(target), pixel = first + ivec2(column, top);
    vec4 pixels[RUN], rows[RUN / 2 + 4];

    // First, since they take as long as the tile.
    [[unroll]] for (int i = 0; i < RUN; ++i)
        pixels[i] = HAS_OWN ? texelFetch(own, min(pixel + ivec2(0, i), size - 1), 0) : vec4(0.0);
    load_tile(first / 2 - 2);
    barrier();
    [[unroll]] for (int row = 0; row < RUN / 2 + 4; ++row) {
        int at = (column + 1) / 2, line = top / 2 + row;
        rows[row] = four(tile[line][at], tile[line][at + 1], tile[line][at + 2],
                         tile[line][at + 3], (column & 1) == 1);
    }
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        int at = (i + 1) / 2;
        vec4 sum = four(rows[at], rows[at + 1], rows[at + 2], rows[at + 3], (i & 1) == 1);
        ivec2 place = pixel + ivec2(0, i);
        if (all(lessThan(place, size)))
            imageStore(target, place, shade(pixels[i], params.coarse * sum, place));
    }
}
