// A blur in one direction with all taps on integer texels. An invocation writes LINE_OUTPUTS pixels
// along the line and loads each texel once for all of them.

UNIFORM_BLOCK(LINE_BLOCK);

layout(local_size_x_id = 34, local_size_y_id = 35) in;
layout(set = 0, binding = BINDING_OF(SLOT_SOURCE), SOURCE_FORMAT) uniform readonly image2D source;
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

const int LOADED = LINE_OUTPUTS + 2 * UNROLLED_RADIUS;

ivec2 along()
{
    bool vertical = ROLLED != 0 ? params.vertical != 0 : DIRECTION == DIRECTION_VERTICAL;
    return vertical ? ivec2(0, 1) : ivec2(1, 0);
}

vec4 load(ivec2 pixel, int texels)
{
    ivec2 texel = pixel + (params.origin + texels) * along();
    return imageLoad(source, clamp(texel, ivec2(0), imageSize(source) - 1));
}

void add_short(ivec2 first, inout vec4 sums[LINE_OUTPUTS])
{
    vec4 texels[LOADED];

    [[unroll]] for (int i = 0; i < LOADED; ++i)
        texels[i] = load(first, i - UNROLLED_RADIUS);
    [[unroll]] for (int i = 0; i < LINE_OUTPUTS; ++i)
        [[unroll]] for (int tap = 0; tap <= 2 * UNROLLED_RADIUS; ++tap)
            sums[i] += params.kernel[tap >> 2][tap & 3] * texels[i + tap];
}

// Adds as many taps at a time as there are outputs, so that all loops have a constant length.
void add_long(ivec2 first, inout vec4 sums[LINE_OUTPUTS])
{
    vec4 texels[2 * LINE_OUTPUTS - 1];

    [[unroll]] for (int i = 0; i < LINE_OUTPUTS - 1; ++i)
        texels[LINE_OUTPUTS + i] = load(first, i - params.radius);
    for (int chunk = 0; chunk <= 2 * params.radius; chunk += LINE_OUTPUTS) {
        [[unroll]] for (int i = 0; i < LINE_OUTPUTS - 1; ++i)
            texels[i] = texels[LINE_OUTPUTS + i];
        [[unroll]] for (int i = 0; i < LINE_OUTPUTS; ++i)
            texels[LINE_OUTPUTS - 1 + i] = load(first, chunk + LINE_OUTPUTS - 1 + i - params.radius);
        [[unroll]] for (int tap = 0; tap < LINE_OUTPUTS; ++tap)
            [[unroll]] for (int i = 0; i < LINE_OUTPUTS; ++i)
                sums[i] += params.kernel[(chunk >> 2) + (tap >> 2)][tap & 3] * texels[i + tap];
    }
}

void write(ivec2 pixel, vec4 sum)
{
    if (all(lessThan(pixel, imageSize(target))))
        imageStore(target, pixel, stored(sum));
}

// With `levels` STORED is that of floats.
vec3 stored_rolled(vec3 sum, bool levels)
{
    if (STORED != STORED_SINGLE)
        return storable(sum);
    return levels ? nearest_level(sum) * (1.0 / 255.0) : storable(sum);
}

// The same as with add_short, where a compiler takes longer than the pass: it has one load and one
// store to translate. Without it the first call of `Separable` on 400 x 400 takes 0.22 s in place of 0.10, with
// Mesa 25.0.7 0.21 in place of 0.16, and the next calls as long (processor time without caches, lavapipe of
// Mesa 22.3.6, 2026-11-28). sums[tap] is of the pixel that gets this tap of the texel. The number of texels
// is no constant, so that the loop stays one. Workgroups lie across the lines. All parameters are read
// before the loop: in it, llvmpipe loads them for one invocation after the other.
void blur_rolled()
{
    ivec2 place = ivec2(gl_GlobalInvocationID.xy) * ivec2(1, ROLLED_OUTPUTS);
    ivec2 direction = along(), first = direction.y != 0 ? place : place.yx;
    ivec2 size = imageSize(target), last = imageSize(source) - 1;
    ivec2 texel = first + (params.origin - UNROLLED_RADIUS) * direction;
    ivec2 pixel = first - 2 * UNROLLED_RADIUS * direction;
    ivec2 left = (size - first) * direction;
    int number = 0, count = min(ROLLED_OUTPUTS, max(left.x, left.y)) + 2 * params.radius;
    bool levels = params.levels != 0;
    float weights[2 * UNROLLED_RADIUS + 1];
    // Alpha apart: compilers do not remove a part of a vector that lives over an iteration.
    vec3 sums[2 * UNROLLED_RADIUS + 1];
    float alphas[2 * UNROLLED_RADIUS + 1];

    [[unroll]] for (int tap = 0; tap < 2 * UNROLLED_RADIUS + 1; ++tap) {
        // The kernel is symmetric.
        int same = max(tap, 2 * UNROLLED_RADIUS - tap);
        weights[tap] = params.kernel[same >> 2][same & 3];
        sums[tap] = vec3(0.0);
        alphas[tap] = 0.0;
    }
    do {
        vec4 value = imageLoad(source, clamp(texel, ivec2(0), last));
        [[unroll]] for (int j = 2 * UNROLLED_RADIUS; j > 0; --j) {
            sums[j] = sums[j - 1] + weights[j] * value.rgb;
            alphas[j] = alphas[j - 1] + weights[j] * value.a;
        }
        sums[0] = weights[0] * value.rgb;
        alphas[0] = weights[0] * value.a;
        if (number >= 2 * UNROLLED_RADIUS && all(lessThan(pixel, size))) {
            vec3 colour = stored_rolled(sums[2 * UNROLLED_RADIUS], levels);
            float alpha = stored_rolled(vec3(alphas[2 * UNROLLED_RADIUS]), levels).r;
            imageStore(target, pixel, vec4(colour, ALPHA == ALPHA_BLUR ? alpha : 1.0));
        }
        texel += direction;
        pixel += direction;
        ++number;
    } while (number < count);
}

void blur_unrolled()
{
    // Of a square, neighbours lie across the lines, so that their texels are adjacent.
    bool turned = GROUP_WIDTH == GROUP_HEIGHT && DIRECTION == DIRECTION_HORIZONTAL;
    ivec2 local = turned ? ivec2(gl_LocalInvocationID.yx) : ivec2(gl_LocalInvocationID.xy);
    ivec2 place = ivec2(gl_WorkGroupID.xy) * ivec2(GROUP_WIDTH, GROUP_HEIGHT) + local;
    ivec2 first = place * (along() * (LINE_OUTPUTS - 1) + 1);
    vec4 sums[LINE_OUTPUTS];

    if (any(greaterThanEqual(first, imageSize(target))))
        return;
    [[unroll]] for (int i = 0; i < LINE_OUTPUTS; ++i)
        sums[i] = vec4(0.0);
    if (UNROLLED_RADIUS > 0)
        add_short(first, sums);
    else
        add_long(first, sums);
    [[unroll]] for (int i = 0; i < LINE_OUTPUTS; ++i)
        write(first + i * along(), sums[i]);
}

void main()
{
    if (ROLLED != 0)
        blur_rolled();
    else
        blur_unrolled();
}
