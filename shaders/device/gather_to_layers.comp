#version 450
#extension GL_GOOGLE_include_directive : require

#define TO_IMAGE
#define LAYERS
#include "device/gather.glsl"
