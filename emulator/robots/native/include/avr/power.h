/// Power reduction. The bits of PRR are kept; nothing is switched off. The clock stays at 8 MHz.
#ifndef KT_AVR_POWER_H
#define KT_AVR_POWER_H

#include "io.h"

#define KT_POWER_OFF(bits) ((void)(PRR = (uint8_t)(PRR | (bits))))
#define KT_POWER_ON(bits) ((void)(PRR = (uint8_t)(PRR & ~(bits))))
#define KT_POWER_ALL \
    (_BV(PRADC) | _BV(PRSPI) | _BV(PRTWI) | _BV(PRTIM0) | _BV(PRTIM1) | _BV(PRTIM2) | _BV(PRUSART0))

#define power_adc_disable() KT_POWER_OFF(_BV(PRADC))
#define power_adc_enable() KT_POWER_ON(_BV(PRADC))
#define power_spi_disable() KT_POWER_OFF(_BV(PRSPI))
#define power_spi_enable() KT_POWER_ON(_BV(PRSPI))
#define power_twi_disable() KT_POWER_OFF(_BV(PRTWI))
#define power_twi_enable() KT_POWER_ON(_BV(PRTWI))
#define power_timer0_disable() KT_POWER_OFF(_BV(PRTIM0))
#define power_timer0_enable() KT_POWER_ON(_BV(PRTIM0))
#define power_timer1_disable() KT_POWER_OFF(_BV(PRTIM1))
#define power_timer1_enable() KT_POWER_ON(_BV(PRTIM1))
#define power_timer2_disable() KT_POWER_OFF(_BV(PRTIM2))
#define power_timer2_enable() KT_POWER_ON(_BV(PRTIM2))
#define power_usart0_disable() KT_POWER_OFF(_BV(PRUSART0))
#define power_usart0_enable() KT_POWER_ON(_BV(PRUSART0))
#define power_all_disable() KT_POWER_OFF(KT_POWER_ALL)
#define power_all_enable() KT_POWER_ON(KT_POWER_ALL)

typedef enum {
    clock_div_1,
    clock_div_2,
    clock_div_4,
    clock_div_8,
    clock_div_16,
    clock_div_32,
    clock_div_64,
    clock_div_128,
    clock_div_256
} clock_div_t;

#define clock_prescale_set(division) ((void)(CLKPR = (uint8_t)(division)))
#define clock_prescale_get() ((clock_div_t)(CLKPR & 0x0F))

#endif
