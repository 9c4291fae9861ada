#version 450
#extension GL_GOOGLE_include_directive : require

#include "device/strided_copy.glsl"
