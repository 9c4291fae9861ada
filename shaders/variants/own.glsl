// Defines load_own(), which loads COLUMNS pixels of the image `own` at binding 2, and store() for as
// many.
#define LOAD load_own
#define LOAD_IMAGE own
#define LOAD_NUMBER 2
#include "variants/load.glsl"

#define STORE_COUNT COLUMNS
#include "variants/store.glsl"
