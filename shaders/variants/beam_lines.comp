// Blender's sun beams (sun_beams.frag) without jitter, with the sun in the image. All samples of a pixel are on its line
// to the sun, and pixels behind each other see nearly the same texels. So an invocation has BEAM_PIXELS of them: it
// follows their line, column by column, loads the few texels of a column that they may see once, and adds them up with
// the weights of the samples beside that column. Without it `blender_sun_beams` of dense light
// takes 9.9 s in place of 3.0 (processor time of 1920 x 1080, lavapipe of Mesa 22.3.6, 2026-11-29).
//
// A side has the pixels that are further from the sun along the one axis (right, left) than along the other one, or not
// (below, above). Columns and rows are those of a side: of the latter two they are the image's rows and columns.

UNIFORM_BLOCK(SUN_BEAMS_BLOCK);
#include "variants/pixels.glsl"
#include "lib/beam.glsl"

READ_IMAGE(SLOT_SOURCE, source);
READ_IMAGE(SLOT_DARK, dark);
// For pixels that are not stored in runs.
RUNS(uint64_t, eighths_of_target);

layout(local_size_x = ROW_INVOCATIONS) in;

const int PIXELS = BEAM_PIXELS;
// Nearer to the sun, steps differ from a texel by so much that a column may be beside more than three samples.
const int NEAR_STEPS = 16;

// A block of PIXELS columns, numbered from the sun: the size of the image, the sun, the outermost column of the block, how
// far it is from the sun, and on which side.
struct Block {
    ivec2 size;
    vec2 sun;
    int column, direction;
    float outer;
    bool swaps, exists;
};

ivec2 swapped(ivec2 place, bool swaps)
{
    return swaps ? place.yx : place;
}

Block block_of(int number)
{
    ivec2 size = READ_SIZE(SLOT_SOURCE);
    vec2 sun = texels_of(vec2(params.sun_x, params.sun_y), size);
    // The first ones on the right of the sun and below it, and the blocks of the four sides.
    ivec2 first = ivec2(ceil(sun)), after = (size - first + PIXELS - 1) / PIXELS, before = (first + PIXELS - 1) / PIXELS;
    ivec4 ends = ivec4(after.x, after.x + before.x, after.x + before.x + after.y, 0);
    ends.w = ends.z + before.y;
    bool swaps = number >= ends.y, is_after = swaps ? number < ends.z : number < ends.x;
    int skipped = swaps ? (is_after ? ends.y : ends.z) : is_after ? 0 : ends.x;
    int direction = is_after ? 1 : -1, nearest = (swaps ? first.y : first.x) - (is_after ? 0 : 1);
    int column = nearest + direction * (PIXELS * (number - skipped) + PIXELS - 1);
    sun = swaps ? sun.yx : sun;
    return Block(swapped(size, swaps), sun, column, direction, float(direction) * (float(column) - sun.x), swaps,
                 number < ends.w);
}

// The line of an invocation goes from this row of the outermost column to the sun. So that all pixels of the block are on
// a line, lines begin outside of the image, too.
ivec2 ends_of_lines(Block block)
{
    float inner = block.outer - float(PIXELS - 1), larger = block.outer / max(inner, 0.01);
    float above = min(block.outer * (1.0 + 0.5 / max(inner, 0.5)), (block.sun.y + 1.0) * larger) + 1.0;
    float below = min(block.outer * (1.0 + 0.5 / max(inner, 0.5)), (float(block.size.y) - block.sun.y) * larger) + 1.0;
    return ivec2(floor(block.sun.y - above), ceil(block.sun.y + below));
}

// The row of a line's pixel. Lines are less than a row apart there: none is left out, some are on two lines.
int row_of(Block block, int line, int pixel)
{
    return line - int(floor((float(line) - block.sun.y) * (float(pixel) / block.outer) + 0.5));
}

// Whether a line's pixel is one of this side, and not also of the line before, if there is one.
bool is_own(Block block, int first, int line, int pixel, ivec2 place)
{
    vec2 away = abs(vec2(place) - block.sun);
    return all(equal(clamp(place, ivec2(0), block.size - 1), place)) && (block.swaps ? away.x > away.y : away.x >= away.y)
        && (line == first || row_of(block, line - 1, pixel) != place.y);
}

// As an integer, since llvmpipe takes three operations for a maximum of floats.
float positive(float value)
{
    return intBitsToFloat(max(floatBitsToInt(value), 0));
}

void store_pixel(ivec2 pixel, vec3 sum)
{
    uvec4 raw = buffer_of(vec4(sum, 1.0));
#if CHANNEL_BYTES == 2
    eighths_of_target.runs[2 * pixel.y * target_shape.z + pixel.x] = eighth(raw.xy);
#else
    runs_of_target.runs[pixel.y * target_shape.z + pixel.x] = u64vec2(eighth(raw.xy), eighth(raw.zw));
#endif
}

// A pixel that is near the sun, as sun_beams.frag has it.
void write_near(ivec2 pixel, Beam beam)
{
    ivec4 shape = read_shapes[SLOT_SOURCE];
    ivec2 last = shape.xy - 1;
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    for (int number = 0; number <= beam.last; ++number) {
        vec2 place = texels_of(beam.share + float(number) * beam.towards, shape.xy), integer = floor(place);
        ivec2 low = clamp(ivec2(integer), ivec2(0), last), high = clamp(ivec2(integer) + 1, ivec2(0), last);
        vec2 part = place - integer;
        vec4 upper = mix(load_pixel(source, shape, low.x, low.y), load_pixel(source, shape, high.x, low.y), part.x);
        vec4 lower = mix(load_pixel(source, shape, low.x, high.y), load_pixel(source, shape, high.x, high.y), part.x);
        float weight = weight_at(beam, float(number));
        weights += weight;
        sum += weight * mix(upper, lower, part.y);
    }
    store_pixel(pixel, sum.rgb / weights);
}

// Whether there is light in the BEAM_RUN columns of a line around a place.
bool is_lit(Block block, int column, float row)
{
    ivec2 place = clamp(ivec2(column, int(row)), ivec2(0), block.size - 1) / BEAM_BLOCK;
    place = swapped(place, block.swaps);
    return load_pixel(dark, read_shapes[SLOT_DARK], place.x, place.y).a < 0.0;
}

// Adds up the columns of a line, of which the pixels see no more than ROWS texels each. Between two texels the light is
// linear. So with differences of differences of the texels, the sums are those of the weights, of the weights times the
// row, and of the weights times the part of the row that is above 1, 2 and so on.
#define ADD_COLUMNS(ROWS, IS_ITS) \
    [[dont_unroll]] for (int first = 0; IS_ITS && first <= last; first += BEAM_RUN) { \
        int middle = first + BEAM_RUN / 2; \
        bool lit = is_lit(block, block.column - block.direction * middle, float(line) + float(middle) * slope); \
        [[dont_unroll]] for (int at = first; lit && at < first + BEAM_RUN; ++at) { \
            int x = clamp(block.column - block.direction * at, 0, block.size.x - 1); \
            float base = floor(float(line) + float(at) * slope - 0.5 * float(ROWS)) + 1.0; \
            vec3 texels[ROWS]; \
            [[unroll]] for (int i = 0; i < ROWS; ++i) { \
                ivec2 place = swapped(ivec2(x, clamp(int(base) + i, 0, block.size.y - 1)), block.swaps); \
                texels[i] = load_pixel(source, shape, place.x, place.y).rgb; \
            } \
            [[unroll]] for (int i = ROWS - 1; i > 0; --i) \
                texels[i] -= texels[i - 1]; \
            [[unroll]] for (int i = ROWS - 1; i > 1; --i) \
                texels[i] -= texels[i - 1]; \
            [[unroll]] for (int k = 0; k < PIXELS; ++k) { \
                float away = float(at - k), number = positive(ceil(away * inverse[k] - inverse[k])); \
                float beside = number * along[k] - away, y = number * across[k] + (rows[k] - base); \
                float part = 1.0 - number * less[k], ramps[ROWS]; \
                [[unroll]] for (int i = 0; i < ROWS; ++i) \
                    ramps[i] = 0.0; \
                [[unroll]] for (int i = 0; i < 3; ++i) { \
                    float left = positive(part), weight = left * left * positive(1.0 - (i == 2 ? beside : abs(beside))); \
                    ramps[0] += weight; \
                    ramps[1] += weight * y; \
                    [[unroll]] for (int j = 2; j < ROWS; ++j) \
                        ramps[j] += weight * positive(y - float(j - 1)); \
                    beside += along[k]; \
                    y += across[k]; \
                    part -= less[k]; \
                } \
                [[unroll]] for (int i = 0; i < ROWS; ++i) \
                    sums[k] += ramps[i] * texels[i]; \
            } \
        } \
    }

void main()
{
    copy_shapes();
    Block block = block_of(int(gl_WorkGroupID.y));
    ivec2 ends = ends_of_lines(block);
    int line = ends.x + int(gl_GlobalInvocationID.x);
    if (!block.exists || line > ends.y)
        return;
    ivec4 shape = read_shapes[SLOT_SOURCE];
    float slope = (block.sun.y - float(line)) / block.outer, steepest = 0.0;
    // Of each pixel its row, a step along both axes, the steps to the next column, and the part of a step in all of them.
    float rows[PIXELS], along[PIXELS], across[PIXELS], inverse[PIXELS], less[PIXELS];
    vec3 sums[PIXELS];
    int last = 0;
    [[unroll]] for (int k = 0; k < PIXELS; ++k) {
        int row = row_of(block, line, k);
        ivec2 pixel = swapped(ivec2(block.column - block.direction * k, row), block.swaps);
        Beam beam = beam_of(pixel, shape.xy);
        vec2 towards = abs(beam.towards) * vec2(shape.xy);
        rows[k] = float(row);
        along[k] = block.swaps ? towards.y : towards.x;
        across[k] = (block.swaps ? towards.x : towards.y) * sign(block.sun.y - rows[k]);
        inverse[k] = 1.0 / along[k];
        less[k] = 1.0 / float(beam.steps);
        sums[k] = vec3(0.0);
        last = max(last, int(float(beam.steps) * along[k]) + 1 + k);
        steepest = max(steepest, abs(across[k] * inverse[k]));
    }
    // Within a column a line changes its row by its slope, and pixels are up to half a row beside the line.
    ADD_COLUMNS(4, steepest <= 0.5)
    ADD_COLUMNS(5, steepest > 0.5)
    [[unroll]] for (int k = 0; k < PIXELS; ++k) {
        ivec2 place = ivec2(block.column - block.direction * k, int(rows[k]));
        float steps = round(1.0 / less[k]);
        if (is_own(block, ends.x, line, k, place) && steps >= float(NEAR_STEPS))
            store_pixel(swapped(place, block.swaps), sums[k] * (6.0 * steps / ((steps + 1.0) * (2.0 * steps + 1.0))));
    }
    bool is_near = params.most < NEAR_STEPS || block.outer < float(2 * NEAR_STEPS + PIXELS);
    [[dont_unroll]] for (int k = 0; is_near && k < PIXELS; ++k) {
        ivec2 place = ivec2(block.column - block.direction * k, row_of(block, line, k));
        ivec2 pixel = swapped(place, block.swaps);
        Beam beam = beam_of(pixel, shape.xy);
        if (is_own(block, ends.x, line, k, place) && beam.steps < NEAR_STEPS)
            write_near(pixel, beam);
    }
}
