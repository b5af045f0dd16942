/// What an overhead controller says to robot programs.
#ifndef __OHC_H__
#define __OHC_H__  // NOLINT(bugprone-reserved-identifier): programs know it

#include <stdint.h>

/// `data` of a message of type GPS: where robot `id` is, as a camera above sees it.
typedef struct {
    uint16_t id;
    int16_t x;
    int16_t y;
    int8_t theta;
    uint16_t unused;
} gpsmsg_t;

#endif
