// Blender's recursive filter along rows, columns or diagonals: each pixel is mixed with one before it,
// which is mixed already, and one after it (formulas of the compositor of Blender 5.0). TRANSPOSED, from the end
// of each line: a pixel gets the cotangents of the one after it that it was mixed into, complete, and has shares
// of these for itself and for the one after it.

UNIFORM_BLOCK(STAR_BLOCK);

layout(local_size_x = ROW_INVOCATIONS) in;
SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_BEFORE, before);
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

// The pixels of a line: the first one, the step to the next one, and their number; 0: there is no such
// line.
struct Line {
    ivec2 first, towards;
    int count;
};

// The first pixel of a line: on the side that it leaves, then at the bottom.
ivec2 start_of(int line, ivec2 size)
{
    int side = params.step_x < 0 ? size.x - 1 : 0;
    if (params.step_x == 0)
        return ivec2(line, size.y - 1);
    if (line < size.y)
        return ivec2(side, line);
    int along = line - size.y + 1;
    return ivec2(params.step_x < 0 ? side - along : along, size.y - 1);
}

Line line_of(int number, ivec2 size)
{
    ivec2 towards = ivec2(params.step_x, params.step_y);
    int lines = (towards.x != 0 ? size.y : 0) + (towards.y != 0 ? size.x : 0);
    if (number >= lines - (towards.x != 0 && towards.y != 0 ? 1 : 0))
        return Line(ivec2(0), ivec2(0), 0);
    ivec2 first = start_of(number, size);
    int across = towards.x > 0 ? size.x - first.x : towards.x < 0 ? first.x + 1 : size.y;
    int count = towards.y != 0 ? min(across, first.y + 1) : across;
    if (params.backwards != 0)
        return Line(first + (count - 1) * towards, -towards, count);
    return Line(first, towards, count);
}

vec4 fetch(Line line, int at)
{
    return at >= 0 && at < line.count ? texelFetch(source, line.first + at * line.towards, 0)
                                      : vec4(0.0);
}

void main()
{
    Line line = line_of(int(gl_GlobalInvocationID.x), textureSize(source, 0));
    float own = 1.0 - params.fade, end = 0.5 * params.fade;
    vec4 mixed[STAR_ITERATIONS - 1];

    // As many pixels at a time as a pixel is away from the one that it is mixed with. So each has its own element: llvmpipe
    // loads and stores arrays with computed indices lane by lane, with which `blender_simple_star` takes 413 ms in place of
    // 186 (processor time of 1920 x 1080, lavapipe of Mesa 22.3.6, 2026-11-29).
#ifdef TRANSPOSED
    for (int first = (line.count - 1) / DISTANCE * DISTANCE; first >= 0; first -= DISTANCE)
        [[unroll]] for (int slot = 0; slot < DISTANCE; ++slot) {
            ivec2 place = line.first + (first + slot) * line.towards;
            if (first + slot < line.count) {
                vec4 cotangent = texelFetch(source, place, 0);
                if (first + slot + DISTANCE < line.count) {
                    cotangent += end * mixed[slot];
                    imageStore(target, place + DISTANCE * line.towards, own * mixed[slot] + end * cotangent);
                }
                mixed[slot] = cotangent;
            }
        }
    [[unroll]] for (int slot = 0; slot < DISTANCE; ++slot)
        if (slot < line.count)
            imageStore(target, line.first + slot * line.towards, own * mixed[slot]);
#else
    vec4 values[STAR_ITERATIONS - 1];

    [[unroll]] for (int slot = 0; slot < DISTANCE; ++slot) {
        mixed[slot] = vec4(0.0);
        values[slot] = fetch(line, slot);
    }
    for (int first = 0; first < line.count; first += DISTANCE)
        [[unroll]] for (int slot = 0; slot < DISTANCE; ++slot) {
            vec4 next = fetch(line, first + slot + DISTANCE);
            mixed[slot] = stored(own * values[slot] + end * (next + mixed[slot]));
            values[slot] = next;
            ivec2 place = line.first + (first + slot) * line.towards;
            if (first + slot < line.count) {
                vec4 value = mixed[slot];
                if (ADDS_IMAGE != 0)
                    value = stored(value + texelFetch(before, place, 0));
                imageStore(target, place, value);
            }
        }
#endif
}
