/// Atomic blocks, which no callback interrupts even if they let time pass, and blocks with
/// interrupts on. However a block is left, SREG is restored.
#ifndef KT_UTIL_ATOMIC_H
#define KT_UTIL_ATOMIC_H

#include "../avr/interrupt.h"

static inline uint8_t kt_enter_nonatomic(void) {
    const uint8_t sreg = kt_enter_atomic();
    kt_sei();
    return sreg;
}

static inline void kt_forbid_interrupts(const uint8_t *sreg) {
    (void)sreg;
    kt_cli();
}

#define KT_BLOCK(type, enter)                                                         \
    for (uint8_t kt_sreg __attribute__((cleanup(type), unused)) = enter, kt_once = 1; \
         kt_once != 0; kt_once = 0)

#define ATOMIC_BLOCK(type) KT_BLOCK(type, kt_enter_atomic())
#define ATOMIC_RESTORESTATE kt_restore_sreg
#define ATOMIC_FORCEON kt_leave_atomic

#define NONATOMIC_BLOCK(type) KT_BLOCK(type, kt_enter_nonatomic())
#define NONATOMIC_RESTORESTATE kt_restore_sreg
#define NONATOMIC_FORCEOFF kt_forbid_interrupts

#endif
