// The mean of the pixels up to a radius away along a row or a column, of those inside of the image. Each
// invocation follows a line with a running sum, which it corrects for what the additions round off.

UNIFORM_BLOCK(BOX_BLOCK);

layout(local_size_x = ROW_INVOCATIONS) in;
layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

vec4 sum = vec4(0.0), rest = vec4(0.0);

void add(vec4 value)
{
    vec4 whole = value + rest, total = sum + whole;
    rest = whole - (total - sum);
    sum = total;
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
        if (at + radius < count)
            add(texelFetch(source, first + (at + radius) * towards, 0));
        if (at > radius)
            add(-texelFetch(source, first + (at - radius - 1) * towards, 0));
        int inside = min(at + radius, count - 1) - max(at - radius, 0) + 1;
        if (at >= 0)
            imageStore(target, first + at * towards, stored(sum / float(inside)));
    }
}
