#version 450
#extension GL_GOOGLE_include_directive : require

#define TO_IMAGE
#include "device/strided_copy.glsl"
