// The colour targets of the G-buffer pass. A normal of length 0 marks what the light leaves alone:
// its albedo is its colour.

layout(location = 0) out vec4 albedo;
layout(location = 1) out vec4 normal;
layout(location = 2) out vec4 position;
layout(location = 3) out vec4 brightness;
