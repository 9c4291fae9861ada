// The images of a pass that reads runs of one image and writes runs of another one. Define before it
// is included:
//
//   COLUMNS  the pixels that store() writes (a constant)
//   LOADED   the pixels of load_run() (a constant)
//
// and LOAD_FROM and LOAD_CHANNELS as for variants/load.glsl.

READ_IMAGE(SLOT_SOURCE, source);

#define LOAD load_run
#define LOAD_COUNT LOADED
#include "variants/load.glsl"

#include "variants/store.glsl"
