/// Instructions by the names that avr-gcc has for them.
#ifndef KT_AVR_BUILTINS_H
#define KT_AVR_BUILTINS_H

#include "../kt_avr.h"

#define __builtin_avr_nop() __asm__ volatile("" ::: "memory")
#define __builtin_avr_sei() kt_sei()
#define __builtin_avr_cli() kt_cli()
#define __builtin_avr_sleep() kt_sleep()
#define __builtin_avr_wdr() ((void)0)
#define __builtin_avr_swap(byte) ((uint8_t)((uint8_t)(byte) << 4 | (uint8_t)(byte) >> 4))
#define __builtin_avr_delay_cycles(cycles) kt_delay(cycles)

#endif
