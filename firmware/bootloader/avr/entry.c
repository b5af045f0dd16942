#include "entry.h"

#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <stdbool.h>

#include "../../kilolib/avr/watchdog.h"
#include "../core/image_record.h"

// With the cause of the last reset, as MCUSR had it, in r2. Interrupts have to be off and the
// vectors where they are after a reset.
static void __attribute__((noreturn)) start_application(uint16_t entry, uint8_t reset_cause) {
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
        start_application(entry, cause);
    __asm__ volatile("rjmp __do_clear_bss");
    __builtin_unreachable();
}

static void move_vectors(uint8_t place) {
    MCUCR = _BV(IVCE);
    MCUCR = place;
}

void boot_take_interrupts(void) {
    move_vectors(_BV(IVSEL));
    sei();
}

// The application that is left may have had any part of the chip at work. All these registers are 0
// after a reset; between them and behind them are the oscillator's, and those of bits that are not.
void boot_silence_chip(void) {
    eeprom_busy_wait();
    PRR = 0;
    for (volatile uint8_t *part = &PINB; part <= &SMCR; part++) *part = 0;
    for (volatile uint8_t *part = &PCICR; part <= &ASSR; part++) *part = 0;
    TWCR = UCSR0B = 0;
}

void boot_leave(void) {
    const uint16_t entry = image_application_entry();
    if (entry == IMAGE_NO_ENTRY) return;
    cli();
    move_vectors(0);
    boot_silence_chip();
    start_application(entry, 0);
}
