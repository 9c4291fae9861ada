#include "transfer/streams.h"

#include <stdint.h>
#include <string.h>

#ifdef __SSE2__
#include <emmintrin.h>

void vkb_stream(unsigned char *to, const unsigned char *from, size_t size)
{
    const size_t step = sizeof(__m128i), head = -(uintptr_t)to % step;

    if (size >= head + step) {
        memcpy(to, from, head);
        to += head;
        from += head;
        size -= head;
        for (; size >= step; to += step, from += step, size -= step)
            _mm_stream_si128((__m128i *)(void *)to,
                             _mm_loadu_si128((const __m128i *)(const void *)from));
    }
    memcpy(to, from, size);
}

void vkb_end_streaming(void)
{
    _mm_sfence();
}
#else
void vkb_stream(unsigned char *to, const unsigned char *from, size_t size)
{
    memcpy(to, from, size);
}

void vkb_end_streaming(void)
{
}
#endif
