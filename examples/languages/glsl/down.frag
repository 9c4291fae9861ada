#version 450
// 13 taps: five overlapping boxes.
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 result;
layout(binding = 0) uniform sampler2D source;
layout(push_constant) uniform Push { vec2 texel; };

vec4 tap(float x, float y) { return texture(source, uv + vec2(x, y) * texel); }

void main()
{
    vec4 inner = tap(-1.0, -1.0) + tap(1.0, -1.0) + tap(-1.0, 1.0) + tap(1.0, 1.0);
    vec4 sides = tap(0.0, -2.0) + tap(-2.0, 0.0) + tap(2.0, 0.0) + tap(0.0, 2.0);
    vec4 corners = tap(-2.0, -2.0) + tap(2.0, -2.0) + tap(-2.0, 2.0) + tap(2.0, 2.0);
    result = tap(0.0, 0.0) * 0.125 + inner * 0.125 + sides * 0.0625 + corners * 0.03125;
}
