// The kernel of a convolution at the places of the padded lines: its point at 0, what lies before it at
// the end. Values whose light comes from the same place are added: beyond an edge all of them, with a
// period those that are whole periods apart.

UNIFORM_BLOCK(FFT_KERNEL_BLOCK);

layout(local_size_x = PIXEL_INVOCATIONS, local_size_y = PIXEL_INVOCATIONS) in;
SAMPLED_IMAGE(SLOT_SOURCE, kernel);
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

// First, last and step of the kernel's places along one axis; `ends`: of those that are not 0.
ivec3 places(int along, int padded, int boundary, int extent, ivec2 ends, int period, int before, int after)
{
    int offset = along <= after ? along : along - padded, centre = extent / 2;
    ivec3 found = ivec3(centre + offset, centre + offset, 1);
    if (offset < -before)
        return ivec3(0, -1, 1);
    if (boundary == BOUNDARY_EDGE) {
        found.x = offset == -before ? ends.x : found.x;
        found.y = offset == after ? ends.y : found.y;
    } else if (boundary == BOUNDARY_WRAP) {
        found = ivec3(ends.x + (((found.x - ends.x) % period) + period) % period, ends.y, period);
    }
    return found;
}

// Of the kernel's pixel at a place of the padded lines.
vec4 sum_at(ivec2 at)
{
    ivec3 x = places(at.x, params.padded_x, params.boundary_x, params.extent_x,
                     ivec2(params.first_x, params.last_x), params.period_x, params.before_x, params.after_x);
    ivec3 y = places(at.y, params.padded_y, params.boundary_y, params.extent_y,
                     ivec2(params.first_y, params.last_y), params.period_y, params.before_y, params.after_y);
    vec4 sum = vec4(0.0);
    for (int j = y.x; j <= y.y; j += y.z)
        for (int i = x.x; i <= x.y; i += x.z)
            sum += texelFetch(kernel, ivec2(i, j), 0);
    return params.gain * sum;
}

void main()
{
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(target))))
        return;
    if (params.channels == 0) {
        vec4 sum = sum_at(at);
        // A grey kernel is the same complex number for both pairs of channels.
        imageStore(target, at, params.grey != 0 ? vec4(sum.r, 0.0, sum.r, 0.0) : sum);
        return;
    }
    // Complete lines have two pixels in a texel, and the channels beside each other (variants/fft_lines.comp).
    int pairs = params.padded_x / 2;
    if (at.x >= pairs)
        return;
    vec4 even = sum_at(ivec2(2 * at.x, at.y)), odd = sum_at(ivec2(2 * at.x + 1, at.y));
    for (int i = 0; i < params.channels; ++i)
        imageStore(target, ivec2(i * (pairs + 1) + at.x, at.y), vec4(even[i], odd[i], 0.0, 0.0));
}
