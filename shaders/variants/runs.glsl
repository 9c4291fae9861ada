// The images of a pass that reads runs of one image and writes runs of another one. Define before it
// is included:
//
//   COLUMNS      the pixels that store() writes (a constant)
//   LOADED       the pixels of load_run() (a constant)
//   LOADED_FROM  the offset of the run from `first` in pixels, 0 or less
//
// and LOADED_CHANNELS, if the source can have 3 channels.

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, source);
WRITE_IMAGE(2);

#ifndef LOADED_CHANNELS
#define LOADED_CHANNELS 4
#endif
#define LOAD load_run
#define LOAD_IMAGE source
#define LOAD_NUMBER 1
#define LOAD_CHANNELS LOADED_CHANNELS
#define LOAD_FROM LOADED_FROM
#define LOAD_COUNT LOADED
#include "variants/load.glsl"

#define STORE_COUNT COLUMNS
#include "variants/store.glsl"
