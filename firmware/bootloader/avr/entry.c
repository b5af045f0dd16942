#include <avr/io.h>
#include <stdbool.h>

#include "../../kilolib/avr/watchdog.h"
#include "../core/image_record.h"
#include "loader.h"

// The boot section's vectors. Entry "stay" is that of reset, entry "start" that of INT0, which no
// robot has; the two interrupts of the receiver have their places. T tells the entries apart.
__attribute__((naked, used, section(".vectors"))) void boot_vectors(void) {
    __asm__ volatile("clt                     \n"  // 0x7000
                     "rjmp 1f                 \n"
                     "set                     \n"  // 0x7004
                     "1: cli                  \n"
                     "clr __zero_reg__        \n"
                     "ldi r24, lo8(%[top])    \n"
                     "out __SP_L__, r24       \n"
                     "ldi r24, hi8(%[top])    \n"
                     "out __SP_H__, r24       \n"
                     "clr r24                 \n"
                     "bld r24, 0              \n"
                     "rjmp boot_begin         \n"
                     ".org 4 * 11             \n"
                     "rjmp __vector_11        \n"  // TIMER1_COMPA
                     ".org 4 * 23             \n"
                     "rjmp __vector_23        \n"  // ANALOG_COMP
                     :
                     : [top] "i"(RAMEND));
}

void boot_application(uint16_t entry, uint8_t reset_cause) {
    __asm__ volatile("mov r2, %[cause] \n"
                     "ijmp             \n"
                     :
                     : [cause] "r"(reset_cause), "z"(entry));
    __builtin_unreachable();
}

// Behind libgcc's start-up code, of which __do_clear_bss, in .init4, is the only part here.
__attribute__((naked, used, section(".init9"))) void boot_stay(void) {
    __asm__ volatile("rjmp boot_load");
}

// Nothing but the stack is used before it is decided to stay: variables that outlive a reset are
// the application's own. After a reset also entry "stay" starts what has a record; a program that a
// programmer put there has none, and calls this entry with the reset's cause still in MCUSR.
__attribute__((used, noreturn)) void boot_begin(bool start) {
    const uint8_t cause = MCUSR;
    MCUSR = 0;
    watchdog_stop();
    const uint16_t entry = image_application_entry();
    if (entry != IMAGE_NO_ENTRY && (start || (cause != 0 && entry != 0)))
        boot_application(entry, cause);
    __asm__ volatile("rjmp __do_clear_bss");
    __builtin_unreachable();
}
