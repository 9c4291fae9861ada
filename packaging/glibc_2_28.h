// Included into every file of the core's wheel: all mathematical functions that glibc 2.29 gave a
// new version, which only sets errno in another way, in the version that older systems have too.
#ifdef __aarch64__
#define VKB_FIRST_GLIBC "GLIBC_2.17"
#else
#define VKB_FIRST_GLIBC "GLIBC_2.2.5"
#endif
__asm__(".symver exp, exp@" VKB_FIRST_GLIBC);
__asm__(".symver exp2, exp2@" VKB_FIRST_GLIBC);
__asm__(".symver log, log@" VKB_FIRST_GLIBC);
__asm__(".symver log2, log2@" VKB_FIRST_GLIBC);
__asm__(".symver pow, pow@" VKB_FIRST_GLIBC);
