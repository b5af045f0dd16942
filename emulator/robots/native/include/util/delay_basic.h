/// Delays by loops of three and four cycles; a count of 0 stands for 256 and 65,536.
#ifndef KT_UTIL_DELAY_BASIC_H
#define KT_UTIL_DELAY_BASIC_H

#include "../kt_avr.h"

static inline __attribute__((unused)) void _delay_loop_1(uint8_t count) {
    kt_wait(3u * (count == 0 ? 256u : count));
}

static inline __attribute__((unused)) void _delay_loop_2(uint16_t count) {
    kt_wait(4u * (count == 0 ? 65536u : count));
}

#endif
