// The filter UPSAMPLE of an image for one pixel of a larger one: along rows, then along columns.
#include "lib/axis.glsl"

Axis along_row;

#define AXIS_FILTER filter_row
#define AXIS_LINEAR linear_in_row
#define AXIS_INSET_CUBIC inset_cubic_in_row
#define AXIS_IMAGE sampler2D image
#define AXIS_ARGUMENT image
#define AXIS_TEXEL(at) fetch_clamped(image, ivec2(at, line))
#include "lib/axis_filter.glsl"

#define AXIS_FILTER filter_column
#define AXIS_LINEAR linear_in_column
#define AXIS_INSET_CUBIC inset_cubic_in_column
#define AXIS_IMAGE sampler2D image
#define AXIS_ARGUMENT image
#define AXIS_TEXEL(at) filter_row(image, along_row, at)
#include "lib/axis_filter.glsl"

// `tap_step` is the distance of the taps of a tent, in texels of the image.
vec4 upsample(sampler2D image, ivec2 pixel, ivec2 target_size, vec2 tap_step)
{
    Place place = place_in(image, pixel, target_size);
    ivec2 size = textureSize(image, 0);
    along_row = axis_x(place, tap_step.x, size, target_size);
    return filter_column(image, axis_y(place, tap_step.y, size, target_size), 0);
}
