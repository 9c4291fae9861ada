// 13 taps down, a tent of 3 x 3 taps up.
Texture2D Source : register(t0);
Texture2D Here : register(t1);
SamplerState Linear : register(s0);

cbuffer Levels : register(b0)
{
    float2 Texel;
    float Radius;
    float Gain;
    float Share;
};

struct Varyings
{
    float4 position : SV_Position;
    float2 uv : TEXCOORD0;
};

float4 Tap(float2 uv, float x, float y) { return Source.Sample(Linear, uv + float2(x, y) * Texel); }

float4 Down(Varyings i) : SV_Target
{
    float2 uv = i.uv;
    float4 inner = Tap(uv, -1, -1) + Tap(uv, 1, -1) + Tap(uv, -1, 1) + Tap(uv, 1, 1);
    float4 sides = Tap(uv, 0, -2) + Tap(uv, -2, 0) + Tap(uv, 2, 0) + Tap(uv, 0, 2);
    float4 corners = Tap(uv, -2, -2) + Tap(uv, 2, -2) + Tap(uv, -2, 2) + Tap(uv, 2, 2);
    return Tap(uv, 0, 0) * 0.125 + inner * 0.125 + sides * 0.0625 + corners * 0.03125;
}

float4 Up(Varyings i) : SV_Target
{
    float4 sum = 0;
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x)
            sum += (2 - abs(x)) * (2 - abs(y)) * Tap(i.uv, x * Radius, y * Radius);
    return Gain * sum / 16.0 + Share * Here.Sample(Linear, i.uv);
}
