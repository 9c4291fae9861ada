// Defines load_own(), which loads COLUMNS pixels of the image `own` at binding 2, and store() for as
// many.
#define LOAD load_own
#define LOAD_IMAGE own
#define LOAD_NUMBER 2
#define LOAD_CHANNELS 4
#define LOAD_FROM 0
#define LOAD_COUNT COLUMNS
#include "variants/load.glsl"

#define STORE_COUNT COLUMNS
#include "variants/store.glsl"
