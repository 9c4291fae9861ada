#: A custom method that counts its frames.
COUNTER = """//!BUFFER counts
//!VAR uint n
//!STORAGE

//!HOOK MAIN
//!BIND counts
//!COMPUTE 64 64 1 1
//!SAVE BLOOM
void hook() { imageStore(out_image, ivec2(0), vec4(float(++n))); }
"""

#: A custom method whose frames depend on the frame before: a share `keep` of TRAIL stays. The first
#: pass reads what the last one saves, and a compute pass reads it, too.
TRAIL = """//!PARAM keep
//!TYPE float
//!MINIMUM 0
//!MAXIMUM 1
0.5

//!HOOK MAIN
//!BIND HISTORY_TRAIL
//!BIND GLOW
//!COMPUTE 8 8
//!SAVE STAYS
void hook() {
    ivec2 at = ivec2(gl_GlobalInvocationID);
    if (all(lessThan(at, ivec2(HISTORY_TRAIL_size))))
        imageStore(out_image, at, keep * texelFetch(HISTORY_TRAIL_raw, at, 0));
}

//!HOOK MAIN
//!BIND STAYS
//!BIND GLOW
//!BIND HISTORY_TRAIL
//!SAVE TRAIL
vec4 hook() {
    float before = HISTORY_TRAIL_tex(HISTORY_TRAIL_pos).a;
    return vec4((1.0 - keep) * GLOW_tex(GLOW_pos).rgb + STAYS_tex(STAYS_pos).rgb, before + 1.0);
}

//!HOOK MAIN
//!BIND TRAIL
//!SAVE BLOOM
vec4 hook() { return TRAIL_tex(TRAIL_pos); }
"""
