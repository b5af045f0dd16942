/// sei() and cli(), and interrupt handlers. A program's own handlers compile, and are never called:
/// ticks and messages reach it through kilolib's callbacks alone.
#ifndef KT_AVR_INTERRUPT_H
#define KT_AVR_INTERRUPT_H

#include "io.h"

#define sei() kt_sei()
#define cli() kt_cli()
#define reti() return

#define ISR_BLOCK
#define ISR_NOBLOCK
#define ISR_NAKED
#define ISR_ALIASOF(vector)

#define BADISR_vect __vector_default
#define ISR(vector, ...) \
    void vector(void);   \
    void vector(void)
#define SIGNAL(vector) ISR(vector)
#define EMPTY_INTERRUPT(vector) \
    ISR(vector) {}
#define ISR_ALIAS(vector, target) \
    void target(void);            \
    ISR(vector) { target(); }

#endif
