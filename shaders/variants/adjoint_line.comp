// The transpose of a filter along one axis, in blocks: an invocation loads each pixel once that the texels of a block
// are read by. With weights from the table alone columns of a Gaussian of 65 taps take 0.73 ms in place of 2.09 (3840 x
// 2160 in float32, H200, 2026-11-28); those of 49 taps 0.34 and their rows 0.60, as it is here 0.26 and 0.20. With two
// blocks an invocation they take 0.18 and 0.19, but rows of 1920 x 1080 34 us in place of 25 (2026-11-30).
#include "lib/adjoint_filter.glsl"

const bool ALONG_X = DIRECTION == DIRECTION_HORIZONTAL;
const int LOADED = 4;

layout(local_size_x = PIXEL_INVOCATIONS, local_size_y = PIXEL_INVOCATIONS) in;
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

// The weights of the block in the middle of the workgroup, which all blocks have that are not near an edge. Behind them
// are zeros.
const int KEPT = SPAN_WIDTH + LOADED;
shared vec4 kept[KEPT];

void keep_weights(int place)
{
    [[dont_unroll]] for (int i = int(gl_LocalInvocationIndex); i < KEPT; i += PIXEL_INVOCATIONS * PIXEL_INVOCATIONS)
        kept[i] = i < SPAN_WIDTH ? entry(place + i) : vec4(0.0);
    barrier();
}

// The pixels that read a block of texels, from `first` to before `end`, and where their weights are.
struct Readers {
    int first, end, place;
};

Readers readers_of(int start, int texels)
{
    ivec4 block = ivec4(entry(start));
    int end = block.w;
    [[unroll]] for (int i = 0; i < ADJOINT_SIDE; ++i) {
        ivec4 texel = ivec4(entry(start + min(i, texels - 1)));
        end = max(end, texel.x + texel.y);
    }
    return Readers(block.w, end, block.z);
}

// Adds the pixels of a line that read the block, with the weights that are kept, or with those of the table.
void add_pixels(bool from_kept, Readers readers, ivec2 texel, inout vec4 sums[ADJOINT_SIDE])
{
    [[dont_unroll]] for (int number = readers.first; number < readers.end; number += LOADED) {
        vec4 values[LOADED];
        [[unroll]] for (int i = 0; i < LOADED; ++i) {
            int pixel = min(number + i, readers.end - 1);  // the weights of others are 0
            values[i] = cotangent_at(ALONG_X ? ivec2(pixel, texel.y) : ivec2(texel.x, pixel));
        }
        [[unroll]] for (int i = 0; i < LOADED; ++i) {
            int at = number + i - readers.first;
            vec4 weights = vec4(0.0);
            if (from_kept)
                weights = kept[at];
            else if (number + i < readers.end)
                weights = entry(readers.place + at);
            [[unroll]] for (int j = 0; j < ADJOINT_SIDE; ++j)
                sums[j] += weights[j] * values[i];
        }
    }
}

void main()
{
    ivec2 size = imageSize(target), next = ALONG_X ? ivec2(1, 0) : ivec2(0, 1);
    // Neighbours lie across the lines, so that their texels are adjacent.
    ivec2 local = ALONG_X ? ivec2(gl_LocalInvocationID.yx) : ivec2(gl_LocalInvocationID.xy);
    ivec2 block = 1 + (ADJOINT_SIDE - 1) * next, group = ivec2(gl_WorkGroupID.xy) * PIXEL_INVOCATIONS * block;
    ivec2 texel = group + local * block, middle = group + PIXEL_INVOCATIONS / 2 * block;
    int start = ALONG_X ? params.start_x : params.start_y, along = ALONG_X ? texel.x : texel.y;
    int last = (ALONG_X ? size.x : size.y) - 1, last_block = last / ADJOINT_SIDE * ADJOINT_SIDE;
    int place = int(entry(start + min(ALONG_X ? middle.x : middle.y, last_block)).z);

    keep_weights(place);
    if (any(greaterThanEqual(texel, size)))
        return;
    Readers readers = readers_of(start + along, last + 1 - along);
    vec4 sums[ADJOINT_SIDE];
    [[unroll]] for (int i = 0; i < ADJOINT_SIDE; ++i)
        sums[i] = vec4(0.0);
    if (readers.place == place)
        add_pixels(true, readers, texel, sums);
    else
        add_pixels(false, readers, texel, sums);
    [[unroll]] for (int i = 0; i < ADJOINT_SIDE; ++i) {
        ivec2 own = texel + i * next;
        if (along + i <= last)
            imageStore(target, own, shade(added_at(own), sums[i], own));
    }
}
