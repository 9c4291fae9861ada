// The source of a stage of glare: what is above the stage's threshold, and nothing outside of the
// image. The including shader's block has a threshold.
#include "lib/threshold.glsl"
#include "lib/above.glsl"
#include "lib/fetch_inside.glsl"
