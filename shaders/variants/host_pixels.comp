// The pixels of passes on the host (csrc/passes/host_fft.h, host_beams.h), which take single floats and leave single
// floats: STAGE_FIRST makes them of the glow, STAGE_LAST stores them in the target's format.

UNIFORM_BLOCK(FFT_BLOCK);
#ifndef TARGET_BYTES
#define TARGET_BYTES 4
#endif
#include "variants/pixels.glsl"
#include "lib/bright.glsl"

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(SLOT_SOURCE, source);
#if TARGET_BYTES == 4
layout(set = 0, binding = TARGET_BINDING, std430) writeonly buffer Target { u64vec2 texels[]; } target;
#elif TARGET_BYTES == 2
layout(set = 0, binding = TARGET_BINDING, std430) writeonly buffer Target { uint64_t texels[]; } target;
#else
layout(set = 0, binding = TARGET_BINDING, std430) writeonly buffer Target { uint texels[]; } target;
#endif

void store(ivec2 at, vec4 value)
{
    int row = at.y - target_shape.w;
#if TARGET_BYTES == 4
    // (Without the maximum LLVM packs lane by lane.)
    uvec4 bits = floatBitsToUint(value);
    target.texels[row * target_shape.z + at.x] = u64vec2(eighth(bits.xy), eighth(bits.zw));
#elif TARGET_BYTES == 2
    uvec2 bits = uvec2(packHalf2x16(value.rg), packHalf2x16(value.ba));
    target.texels[2 * row * target_shape.z + at.x] = eighth(bits);
#else
    // A sum with 2^23 is rounded to an integer, which its last bits are.
    uvec4 level = floatBitsToUint(value * 255.0 + 8388608.0) & 255u;
    target.texels[4 * row * target_shape.z + at.x] =
        level.r | level.g << 8 | level.b << 16 | level.a << 24;
#endif
}

void main()
{
    copy_shapes();
    ivec2 first = first_pixel(ivec2(1, TEXEL_ROWS));
    int end = min(first.y + TEXEL_ROWS, target_shape.y), x = min(first.x, target_shape.x - 1);

    for (int y = first.y; y < end; ++y) {
        vec4 value = load_pixel(source, read_shapes[SLOT_SOURCE], x, y);
        value = STAGE == STAGE_LAST ? stored(value) : glow_of(value);
        if (first.x < target_shape.x)
            store(ivec2(x, y), value);
    }
}
