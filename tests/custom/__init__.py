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
