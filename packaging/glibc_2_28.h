// Included into every file of the core's wheel: the mathematical functions that glibc 2.29 gave a
// new version, which only sets errno in another way, in the version that older systems have too.
__asm__(".symver exp, exp@GLIBC_2.2.5");
__asm__(".symver log2, log2@GLIBC_2.2.5");
__asm__(".symver pow, pow@GLIBC_2.2.5");
