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

// A pixel of the line, or the last one.
ivec2 place_of(Line line, int at)
{
    return line.first + min(at, line.count - 1) * line.towards;
}

vec4 fetch(Line line, int at)
{
    vec4 texel = texelFetch(source, place_of(line, at), 0);
    return at < line.count ? texel : vec4(0.0);
}

// The most pixels between a pixel and the one that it is mixed with. The pixels that an invocation loads before it mixes
// them, so that few wait for memory: a training step takes 7.7 ms in place of 11.7 (3840 x 2160, H200, 2026-11-30).
const int MAX_DISTANCE = STAR_ITERATIONS - 1, LOADED = 8;

// Appends a value to the last DISTANCE ones, of which the first is the oldest. All are moved: llvmpipe loads and stores
// arrays with computed indices lane by lane, with which `blender_simple_star` takes 413 ms in place of 186 (processor
// time of 1920 x 1080, lavapipe of Mesa 22.3.6, 2026-11-29).
void append(vec4 value, inout vec4 queue[MAX_DISTANCE])
{
    [[unroll]] for (int i = 0; i < MAX_DISTANCE; ++i) {
        if (i + 1 < DISTANCE)
            queue[i] = queue[i + 1];
        else if (i + 1 == DISTANCE)
            queue[i] = value;
    }
}

void main()
{
    Line line = line_of(int(gl_GlobalInvocationID.x), textureSize(source, 0));
    float own = 1.0 - params.fade, end = 0.5 * params.fade;
    vec4 mixed[MAX_DISTANCE], loaded[LOADED];

    [[unroll]] for (int i = 0; i < MAX_DISTANCE; ++i)
        mixed[i] = vec4(0.0);
#ifdef TRANSPOSED
    for (int first = (line.count - 1) / LOADED * LOADED; first >= 0; first -= LOADED) {
        [[unroll]] for (int i = 0; i < LOADED; ++i)
            loaded[i] = fetch(line, first + i);
        [[unroll]] for (int i = LOADED - 1; i >= 0; --i) {
            int after = first + i + DISTANCE;
            vec4 cotangent = loaded[i] + end * mixed[0];
            if (after < line.count)
                imageStore(target, place_of(line, after), own * mixed[0] + end * cotangent);
            append(cotangent, mixed);
        }
    }
    [[unroll]] for (int i = 0; i < MAX_DISTANCE; ++i)
        if (i < DISTANCE && DISTANCE - 1 - i < line.count)
            imageStore(target, place_of(line, DISTANCE - 1 - i), own * mixed[i]);
#else
    vec4 values[MAX_DISTANCE], added[LOADED];

    [[unroll]] for (int i = 0; i < MAX_DISTANCE; ++i)
        values[i] = fetch(line, i);
    for (int first = 0; first < line.count; first += LOADED) {
        [[unroll]] for (int i = 0; i < LOADED; ++i) {
            loaded[i] = fetch(line, first + i + DISTANCE);
            added[i] = ADDS_IMAGE != 0 ? texelFetch(before, place_of(line, first + i), 0) : vec4(0.0);
        }
        [[unroll]] for (int i = 0; i < LOADED; ++i) {
            vec4 value = stored(own * values[0] + end * (loaded[i] + mixed[0]));
            append(loaded[i], values);
            append(value, mixed);
            if (ADDS_IMAGE != 0)
                value = stored(value + added[i]);
            if (first + i < line.count)
                imageStore(target, place_of(line, first + i), value);
        }
    }
#endif
}
