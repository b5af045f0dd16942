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

/// Records the handler's name for the engine, which reports that it is never called.
#define KT_HANDLES(vector, name)            \
    static const char kt_handles_##vector[] \
        __attribute__((used, aligned(1), section("kt_handlers"))) = name;

#define BADISR_vect __vector_default
#define ISR(vector, ...)        \
    KT_HANDLES(vector, #vector) \
    void vector(void);          \
    void vector(void)
#define SIGNAL(vector)          \
    KT_HANDLES(vector, #vector) \
    void vector(void);          \
    void vector(void)
#define EMPTY_INTERRUPT(vector) \
    void vector(void);          \
    void vector(void) {}
#define ISR_ALIAS(vector, target) \
    KT_HANDLES(vector, #vector)   \
    void target(void);            \
    void vector(void);            \
    void vector(void) { target(); }

#endif
