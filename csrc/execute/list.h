// Lists of objects with the members `previous` and `next`; `list` points to the first one.
#ifndef VKB_LIST_H
#define VKB_LIST_H

#include <stddef.h>

#define VKB_PUSH(list, one) \
    do { \
        (one)->previous = NULL; \
        (one)->next = *(list); \
        if ((one)->next) \
            (one)->next->previous = (one); \
        *(list) = (one); \
    } while (0)

#define VKB_UNLINK(list, one) \
    do { \
        if ((one)->previous) \
            (one)->previous->next = (one)->next; \
        else \
            *(list) = (one)->next; \
        if ((one)->next) \
            (one)->next->previous = (one)->previous; \
    } while (0)

#endif
