// The body, as what glows.
#define EMISSION
#include "scene/glow.frag"
