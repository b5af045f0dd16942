/// A boot loader's ways in and out (boot_loaders.md 1). Robots and modules have the same, but for
/// the interrupts that they take.
#ifndef BOOTLOADER_AVR_ENTRY_H
#define BOOTLOADER_AVR_ENTRY_H

#include <avr/io.h>
#include <stdint.h>

/// Place of an interrupt's vector, by its number in the datasheet of the chip, less 1: it is taken
/// by the ISR() of that number, or does nothing but wake the loader. In rising order.
#define BOOT_INTERRUPT(number) \
    ".org 4 * " #number " \n"  \
    "rjmp __vector_" #number " \n"
#define BOOT_WAKE(number)     \
    ".org 4 * " #number " \n" \
    "reti \n"

/// The boot section's vectors, once in each loader, with the interrupts that it takes: some
/// before the code of both entries, the others behind it. Entry "stay" is that of
/// reset, entry "start" that of INT0, which no loader takes. T tells them apart.
#define BOOT_VECTORS(early, late)                                                        \
    __attribute__((naked, used, section(".vectors"))) void boot_vectors(void) {          \
        __asm__ volatile("clt                     \n"                                    \
                         "rjmp 1f                 \n"                                    \
                         "set                     \n"                                    \
                         "rjmp 1f                 \n" early "1: cli                  \n" \
                         "clr __zero_reg__        \n"                                    \
                         "ldi r24, lo8(%[top])    \n"                                    \
                         "out __SP_L__, r24       \n"                                    \
                         "ldi r24, hi8(%[top])    \n"                                    \
                         "out __SP_H__, r24       \n"                                    \
                         "clr r24                 \n"                                    \
                         "bld r24, 0              \n"                                    \
                         "rjmp boot_begin         \n" late                               \
                         :                                                               \
                         : [top] "i"(RAMEND));                                           \
    }

/// The loader's main program: receives an image until an application is to be started. Everything
/// of the chip may be in any state but interrupts, which are off, and variables, which are 0.
void boot_load(void) __attribute__((noreturn));

/// Takes the chip over from an application: waits for the EEPROM, stops every part, and leaves all
/// pins inputs, as after a reset. Interrupts have to be off.
void boot_silence_chip(void);

/// Lets interrupts come, by the boot section's vectors.
void boot_take_interrupts(void);

/// Starts the application if it is valid, with the chip as after a reset. Returns if none is.
void boot_leave(void);

#endif
