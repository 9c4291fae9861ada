// The places that Blender's sun beams sample (sun_beams.frag), for shaders with SUN_BEAMS_BLOCK.

uint turned(uint value, int count)
{
    return value << count | value >> (32 - count);
}

// A number of 0 to 1 from two integers: the end of Bob Jenkins' lookup3.
float hashed(uvec2 key)
{
    const int COUNTS[7] = int[](14, 11, 25, 16, 4, 14, 24);
    uvec3 mixed = 0xdeadbeefu + 8u + 13u + uvec3(0, key.yx);
    for (int i = 0; i < 7; ++i) {
        mixed.x = (mixed.x ^ mixed.y) - turned(mixed.y, COUNTS[i]);
        mixed = mixed.zxy;
    }
    return float(mixed.y) / 4294967295.0;
}

// The samples of a pixel: its own place and the way of a step, as shares of the sides; the steps to the sun, and the
// last sample; where the samples are between steps.
struct Beam {
    vec2 share, towards;
    int steps, last;
    float offset;
};

// With jitter the samples are between steps.
#define IS_JITTERED (JITTERED != 0)

Beam beam_of(ivec2 pixel, ivec2 size)
{
    vec2 sun = vec2(params.sun_x, params.sun_y), share = (vec2(pixel) + 0.5) / vec2(size);
    // Blender measures from the pixel's lower left corner.
    ivec2 corner = ivec2(pixel.x, size.y - 1 - pixel.y);
    float distance = max(length(vec2(corner) - vec2(sun.x, 1.0 - sun.y) * vec2(size)), 1.0);
    int steps = min(params.most, int(distance));
    return Beam(share, (sun - share) / distance, steps, int(params.left * float(steps)),
                IS_JITTERED ? hashed(uvec2(corner)) : 0.0);
}

// How many steps away a sample is.
float steps_to(Beam beam, int number)
{
    if (!IS_JITTERED)
        return float(number);
    return params.left > 0.0 ? (float(number) + beam.offset) / params.left : 0.0;
}

// Whether a share of the sides is a place of the image.
bool is_place(vec2 share)
{
    return !any(lessThan(share, vec2(0.0))) && !any(greaterThan(share, vec2(1.0)));
}

float weight_at(Beam beam, float at)
{
    float part = 1.0 - at / float(beam.steps);
    return part * part;
}

// A share of the sides, in texels.
vec2 texels_of(vec2 share, ivec2 size)
{
    return share * vec2(size) - 0.5;
}

// The sum of the weights of a pixel's samples.
float weights_of(ivec2 pixel, ivec2 size)
{
    Beam beam = beam_of(pixel, size);
    float weights = 0.0;
    for (int i = 0; i <= beam.last; ++i) {
        float at = steps_to(beam, i);
        if (!is_place(beam.share + at * beam.towards))
            break;
        weights += weight_at(beam, at);
    }
    return weights;
}
