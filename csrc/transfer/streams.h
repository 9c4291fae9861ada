// Copies without a place in the host's caches, to memory that the device reads: the cache would
// have to read what is overwritten.
#ifndef VKB_STREAMS_H
#define VKB_STREAMS_H

#include <stddef.h>

// Needs vkb_end_streaming in the same thread before the device reads.
void vkb_stream(unsigned char *to, const unsigned char *from, size_t size);

void vkb_end_streaming(void);

#endif
