// The images of a filter in strips, and what becomes of a filtered pixel: with FINAL the end of a bloom, otherwise
// a level, to which the share of an image of the target's size is added. HAS_OWN: whether `own` is read.
layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, source);
READ_IMAGE(2, own);

#ifdef FINAL
#define ENDED_BINDING 3
#include "lib/ended.glsl"
WRITE_IMAGE(ENDED_TARGET);

#define HAS_OWN true

uvec4 shade(uvec4 scene, vec4 sum, ivec2 pixel)
{
    return ended(scene, as_stored(sum, FORMAT), pixel);
}
#else
WRITE_IMAGE(3);
#define HAS_OWN (ADD_OWN != 0)

uvec4 shade(uvec4 level, vec4 sum, ivec2 pixel)
{
    if (ADD_OWN != 0)
        sum += params.own * value_of(level);
    return buffer_of(sum);
}
#endif
