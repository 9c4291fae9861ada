// How variants load and store runs of pixels. With LINEAR_TEXELS (on CPUs) an image is a buffer of 16-byte
// words, since llvmpipe loads a word nearly as fast as one channel. Otherwise it is a storage image.
//
// What llvmpipe does, and what follows (Mesa 22.3.6 and 25.0.7; benchmarks/image.py shows the effect):
// - Mesa 25 does not unroll a loop without [[unroll]], and arrays indexed by its counter are then memory: it
//   stands before every loop but the outermost one. An inner loop needs constant ends: one whose ends depend
//   on an outer counter is not unrolled by Mesa 22.3, and makes the pass five times slower.
// - Variables that live over an iteration are loaded, masked and stored once for each vector. So a blur goes
//   along rows (strip.comp): it keeps 8 sums for each row there, and down columns 8 for each pixel.
// - A load of a word is a call of 60 to 80 instructions for 8 invocations, before which registers move to
//   memory: the loads of an iteration come first, and a word that is needed again is kept.
// - A store is a loop over the invocations, in which each integer is one move. So runs are of 64-bit integers,
//   and as long as rows allow: images have a pitch of whole runs (VKB_STORE_SIZE), and of the caller's arrays
//   only those with such rows are stored directly. The index of a store is computed in that loop if it has a
//   constant operand; one that follows from that of the store before is computed once (store_at).
// - A loop whose rounds depend on data runs until no invocation goes on: its condition comes last. Both sides of
//   an `if` run: what the format of a target decides is a constant (STORED, CHANNEL_BYTES).
// - A pass of a short line costs most when it is compiled: there the loop over pixels stays one (ROLLED). Its
//   number of rounds is a parameter, since Mesa 22.3 unrolls every loop whose rounds it knows. Parameters are
//   read before the loop: in a loop or after a return, Mesa 22.3 loads them for each invocation.
// - A float becomes an integer by a sum with 2^23, and a stored word is the maximum of itself and a zero that
//   the compiler does not know. Else Mesa 25 converts, and LLVM packs, lane by lane.
// - What is used after a store is copied to variables before the first (copy_shapes): it would be loaded again.
// - Minima and maxima are of integers: of floats they take three operations, because of NaN. A half float is
//   rounded and packed in one (nearest_half_bits): packHalf2x16 takes forty operations.
// - A storage buffer reaches maxStorageBufferRange bytes: a larger target takes several dispatches.
//
// A `raw` pixel has its channels as bits: with LINEAR_TEXELS the bits of CHANNEL_BYTES bytes for each
// channel, otherwise the bits of single floats. load.glsl and store.glsl define the functions.

// Channels of the source in memory: 3 where it is the caller's array and has no alpha.
#ifdef RGB
#define SOURCE_CHANNELS 3
#else
#define SOURCE_CHANNELS 4
#endif

// Channels of the target in memory: 3 where the caller's array has no alpha.
#ifndef TARGET_CHANNELS
#define TARGET_CHANNELS 4
#endif

// In 64-bit integers: llvmpipe stores one integer after the other, for one invocation after the
// other. Runs of 24 and 32 bytes need less of its work for each byte than words.
#extension GL_ARB_gpu_shader_int64 : require
#extension GL_EXT_scalar_block_layout : require
#define RUNS(type, name) \
    layout(set = 0, binding = TARGET_BINDING, scalar) writeonly buffer type##_runs { type runs[]; } name
RUNS(u64vec2, runs_of_target);
RUNS(u64vec3, triples_of_target);
RUNS(u64vec4, pairs_of_target);

layout(push_constant) uniform Shapes {
    ivec4 target;    // width, height, words in a row, first row of the bound buffer
    // By binding, from 1 on: width, height, words in a row; of the first also a 0 that compilers do
    // not know.
    ivec4 reads[GATHERED_LEVELS];
} shapes;

// Copies of the members that are used after a store. After a store compilers load a constant again,
// lane by lane.
ivec4 target_shape, read_shapes[GATHERED_LEVELS];
uint unknown_zero;

void copy_shapes()
{
    target_shape = shapes.target;
    read_shapes = shapes.reads;
    unknown_zero = uint(shapes.reads[SLOT_SOURCE].w);
}

// Eight bytes of the target. Without the maximum, LLVM packs lane by lane in the loop that stores.
uint64_t eighth(uvec2 value)
{
    return packUint2x32(max(value, uvec2(unknown_zero)));
}

#define READ_IMAGE(slot, name) layout(set = 0, binding = BINDING_OF(slot)) uniform usamplerBuffer name
#define READ_SIZE(slot) (read_shapes[slot].xy)
#define TARGET_SIZE() (target_shape.xy)

// The first pixel of this invocation's block, in coordinates of the complete target, of which the dispatch may
// cover only some rows.
ivec2 first_pixel(ivec2 block)
{
    return ivec2(gl_GlobalInvocationID.xy) * block + ivec2(0, target_shape.w);
}

vec4 value_of(uvec4 raw)
{
#if CHANNEL_BYTES == 1
    // The same floats that llvmpipe's samplers return for 8 bits.
    return vec4(ivec4(raw.x, raw.x >> 8, raw.x >> 16, raw.x >> 24) & 255) * (1.0 / 255.0);
#elif CHANNEL_BYTES == 2
    return vec4(unpackHalf2x16(raw.x), unpackHalf2x16(raw.y));
#else
    return uintBitsToFloat(raw);
#endif
}

uvec4 raw_of(vec4 value)
{
#if CHANNEL_BYTES == 1
    // The sum with 2^23 is rounded to an integer, which is in its last bits. A conversion is slow
    // in Mesa 25, which converts lane by lane. (The limits are those of nearest_level.)
    vec4 share = intBitsToFloat(clamp(floatBitsToInt(value), ivec4(0), ivec4(floatBitsToInt(1.0))));
    uvec4 level = floatBitsToUint(share * 255.0 + 8388608.0) & 255u;
    return uvec4(level.r | level.g << 8 | level.b << 16 | level.a << 24, 0, 0, 0);
#elif CHANNEL_BYTES == 2
    uvec3 colour = nearest_half_bits(value.rgb);
    uint alpha = nearest_half_bits(value.aaa).r;
    return uvec4(colour.r | colour.g << 16, colour.b | alpha << 16, 0, 0);
#else
    return floatBitsToUint(value);
#endif
}

#if CHANNEL_BYTES == 1
const uvec4 ALPHA_BITS = uvec4(0xff000000u, 0, 0, 0), OPAQUE = ALPHA_BITS;
#elif CHANNEL_BYTES == 2
const uvec4 ALPHA_BITS = uvec4(0, 0xffff0000u, 0, 0), OPAQUE = uvec4(0, 0x3c000000u, 0, 0);
#else
const uvec4 ALPHA_BITS = uvec4(0, 0, 0, 0xffffffffu), OPAQUE = uvec4(0, 0, 0, 0x3f800000u);
#endif

// The value, with the alpha bits of `own`.
uvec4 with_alpha_of(uvec4 own, vec4 value)
{
    return (raw_of(value) & ~ALPHA_BITS) | (own & ALPHA_BITS);
}

// All bits of the half floats that are NaN or infinity.
uvec2 non_finite_halves(uvec2 bits)
{
    // A carry is where all bits of the exponent are set.
    uvec2 non_finite = ((bits & 0x7c007c00u) + 0x04000400u) & 0x80008000u;
    return non_finite | (non_finite - (non_finite >> 15));
}

// The pixel with 0 in place of NaN and infinity in each channel.
uvec4 finite_bits(uvec4 raw)
{
#if CHANNEL_BYTES == 2
    raw.xy &= ~non_finite_halves(raw.xy);
#elif CHANNEL_BYTES != 1
    raw = mix(raw, uvec4(0), equal(raw & 0x7f800000u, uvec4(0x7f800000u)));
#endif
    return raw;
}

// A pixel of a bloom buffer. Its alpha is 1, unless alpha is blurred like a colour.
uvec4 buffer_of(vec4 value)
{
    return ALPHA == ALPHA_BLUR ? raw_of(stored(value)) : with_alpha_of(OPAQUE, stored(value));
}

// A pixel of the finished picture: by its own alpha, NaN and infinity, and what the composite made of
// the rest.
uvec4 finished(uvec4 own, vec4 value)
{
    uvec4 result = ALPHA == ALPHA_KEEP ? with_alpha_of(own, value) : raw_of(value);
    if (FINITE != 0)
        own = uvec4(0);
#if CHANNEL_BYTES == 2
    uvec2 non_finite = non_finite_halves(own.xy);
    result.xy = (own.xy & non_finite) | (result.xy & ~non_finite);
#elif CHANNEL_BYTES == 4
    result = mix(result, own, equal(own & 0x7f800000u, uvec4(0x7f800000u)));
#endif
    return result;
}

// The pixel at this place of a row, from its word.
uvec4 pixel_of(uvec4 word, int at)
{
#if CHANNEL_BYTES == 1
    uvec2 half_word = (at & 2) == 0 ? word.xy : word.zw;
    return uvec4((at & 1) == 0 ? half_word.x : half_word.y, 0, 0, 0);
#elif CHANNEL_BYTES == 2
    return uvec4((at & 1) == 0 ? word.xy : word.zw, 0, 0);
#else
    return word;
#endif
}

// The pixel with this number of a run that begins at a multiple of 16 bytes. Pixels of one word are loaded once.
uvec4 raw_in_run(usamplerBuffer image, ivec4 shape, int first, int number, int row)
{
    int word = row * shape.z + first * CHANNEL_BYTES / 4 + number * CHANNEL_BYTES / 4;
    return pixel_of(texelFetch(image, word), number);
}

// A pixel anywhere in an image of this shape (see Shapes).
uvec4 raw_pixel(usamplerBuffer image, ivec4 shape, int at, int row)
{
    return pixel_of(texelFetch(image, row * shape.z + at * CHANNEL_BYTES / 4), at);
}

vec4 load_pixel(usamplerBuffer image, ivec4 shape, int at, int row)
{
    return value_of(raw_pixel(image, shape, at, row));
}

// A pixel of an image of one single float each.
float load_float(usamplerBuffer image, ivec4 shape, int x, int row)
{
    return uintBitsToFloat(texelFetch(image, row * shape.z + (x >> 2))[x & 3]);
}

// A pixel of an image of single floats. Above and below the image, the outermost rows are repeated.
vec4 load_floats(usamplerBuffer image, ivec4 shape, int x, int row)
{
    return uintBitsToFloat(texelFetch(image, clamp(row, 0, shape.y - 1) * shape.z + x));
}
