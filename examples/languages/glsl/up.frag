#version 450
// A tent of 3 x 3 taps over the smaller level, and this level.
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 result;
layout(binding = 0) uniform sampler2D low;
layout(binding = 1) uniform sampler2D here;
layout(binding = 2) uniform Levels
{
    vec2 texel;
    float radius;
    float gain;
    float share;
} levels;

void main()
{
    vec4 sum = vec4(0.0);
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
            float weight = float((2 - abs(x)) * (2 - abs(y)));
            sum += weight * texture(low, uv + vec2(x, y) * levels.radius * levels.texel);
        }
    result = levels.gain * sum / 16.0 + levels.share * texture(here, uv);
}
