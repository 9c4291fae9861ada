// The mean of the pixels up to a radius away along a row or a column, of those inside of the image. Each
// invocation follows a line with a running sum, which it corrects for what the additions round off. TRANSPOSED,
// a pixel gets the shares of itself that these means have.

UNIFORM_BLOCK(BOX_BLOCK);

layout(local_size_x = ROW_INVOCATIONS) in;
SAMPLED_IMAGE(SLOT_SOURCE, source);
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

vec4 sum = vec4(0.0), rest = vec4(0.0);

void add(vec4 value)
{
    vec4 whole = value + rest, total = sum + whole;
    rest = whole - (total - sum);
    sum = total;
}

// How many pixels the mean at a place is of.
float count_at(int at, int count)
{
    return float(min(at + params.radius, count - 1) - max(at - params.radius, 0) + 1);
}

void main()
{
    ivec2 size = textureSize(source, 0), towards = ivec2(params.across, 1 - params.across);
    int number = int(gl_GlobalInvocationID.x), radius = params.radius;
    int count = params.across != 0 ? size.x : size.y;
    ivec2 first = number * towards.yx;

    if (any(greaterThanEqual(first, size)))
        return;
    for (int at = -radius; at < count; ++at) {
#ifdef TRANSPOSED
#define TAKEN(place) (texelFetch(source, first + (place) * towards, 0) / count_at(place, count))
#define MADE(place)  sum
#else
#define TAKEN(place) texelFetch(source, first + (place) * towards, 0)
#define MADE(place)  (sum / count_at(place, count))
#endif
        if (at + radius < count)
            add(TAKEN(at + radius));
        if (at > radius)
            add(-TAKEN(at - radius - 1));
        if (at >= 0)
            imageStore(target, first + at * towards, stored(MADE(at)));
    }
}
