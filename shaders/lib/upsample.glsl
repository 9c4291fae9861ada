// Filters an image for this pixel of a larger one: along rows, then along columns.
// Include fullscreen.glsl before this file.
#include "lib/axis.glsl"

Axis along_row;

#define AXIS_FILTER filter_row
#define AXIS_IMAGE sampler2D image
#define AXIS_TEXEL(at) fetch_clamped(image, ivec2(at, line))
#include "lib/axis_filter.glsl"

#define AXIS_FILTER filter_column
#define AXIS_IMAGE sampler2D image
#define AXIS_TEXEL(at) filter_row(image, along_row, at)
#include "lib/axis_filter.glsl"

// The filters along rows and along columns are of UPSAMPLE_*; the steps are the distances of their
// taps in texels of the image.
vec4 upsample(sampler2D image, ivec2 kinds, vec2 tap_step)
{
    Place place = PLACE_IN(image);
    ivec2 size = textureSize(image, 0);
    vec2 ratio = vec2(COMPLETE_SIZE(image)) / vec2(params.target_width, params.target_height);
    along_row = axis_x(place, kinds.x, tap_step.x, size, ratio);
    return filter_column(image, axis_y(place, kinds.y, tap_step.y, size, ratio), 0);
}
