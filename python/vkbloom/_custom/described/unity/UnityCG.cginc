// What image effects use of Unity's built-in header, which is in the editor only. Written for
// vkbloom; the vertex functions are there to compile: a triangle covers the target.
#ifndef VKBLOOM_UNITY_CG
#define VKBLOOM_UNITY_CG

#define UNITY_DECLARE_SCREENSPACE_TEXTURE(name) sampler2D name
#define UNITY_SAMPLE_SCREENSPACE_TEXTURE(name, uv) tex2D(name, uv)
#define UNITY_SETUP_STEREO_EYE_INDEX_POST_VERTEX(x)
#define UNITY_VERTEX_INPUT_INSTANCE_ID
#define UNITY_VERTEX_OUTPUT_STEREO
#define UNITY_UV_STARTS_AT_TOP 1

struct appdata_img
{
    float4 vertex : POSITION;
    float2 texcoord : TEXCOORD0;
};

struct v2f_img
{
    float4 pos : SV_POSITION;
    float2 uv : TEXCOORD0;
};

float4 UnityObjectToClipPos(float4 position) { return position; }
float2 UnityStereoScreenSpaceUVAdjust(float2 uv, float4 scale) { return uv * scale.xy + scale.zw; }
float2 UnityStereoTransformScreenSpaceTex(float2 uv) { return uv; }
float2 TransformStereoScreenSpaceTex(float2 uv, float w) { return uv; }

v2f_img vert_img(appdata_img v)
{
    v2f_img made;
    made.pos = v.vertex;
    made.uv = v.texcoord;
    return made;
}

float GammaToLinearSpaceExact(float value)
{
    return value <= 0.04045 ? value / 12.92 : pow((value + 0.055) / 1.055, 2.4);
}

float LinearToGammaSpaceExact(float value)
{
    return value <= 0.0031308 ? value * 12.92 : 1.055 * pow(value, 1.0 / 2.4) - 0.055;
}

// The curves of Chilliant (2012), as approximations of sRGB by polynomials.
float3 GammaToLinearSpace(float3 c) { return c * (c * (c * 0.305306011 + 0.682171111) + 0.012522878); }
float3 LinearToGammaSpace(float3 c)
{
    return max(1.055 * pow(max(c, 0.0), 0.416666667) - 0.055, 0.0);
}

float Luminance(float3 c) { return dot(c, float3(0.2126729, 0.7151522, 0.0721750)); }

#endif
