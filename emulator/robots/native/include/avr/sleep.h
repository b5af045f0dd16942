/// Sleep. Whatever the mode, the robot wakes at its next tick.
#ifndef KT_AVR_SLEEP_H
#define KT_AVR_SLEEP_H

#include "io.h"

#define set_sleep_mode(mode) \
    ((void)(SMCR = (uint8_t)((SMCR & ~(_BV(SM0) | _BV(SM1) | _BV(SM2))) | (mode))))
#define sleep_enable() ((void)(SMCR = (uint8_t)(SMCR | _BV(SE))))
#define sleep_disable() ((void)(SMCR = (uint8_t)(SMCR & ~_BV(SE))))
#define sleep_cpu() kt_sleep()
#define sleep_bod_disable() ((void)0)
#define sleep_mode()     \
    do {                 \
        sleep_enable();  \
        sleep_cpu();     \
        sleep_disable(); \
    } while (0)

#endif
