// A boot loader without an application: counts timer interrupts by vectors in its own section, and
// programs a page.
#include <avr/boot.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>

volatile uint8_t boot_interrupts, programmed;

ISR(TIMER0_COMPA_vect) { boot_interrupts++; }

int main(void) {
    MCUCR = 1 << IVCE;
    MCUCR = 1 << IVSEL;
    OCR0A = 10;
    TCCR0A = 1 << WGM01;
    TCCR0B = 1 << CS01;
    TIMSK0 = 1 << OCIE0A;
    sei();
    while (boot_interrupts < 3) {
    }
    cli();
    boot_page_erase(0x4000);
    boot_spm_busy_wait();
    boot_page_fill(0x4000, 0x1234);
    boot_page_write(0x4000);
    boot_spm_busy_wait();
    boot_rww_enable();
    programmed = pgm_read_word(0x4000) == 0x1234;
    for (;;) {
    }
}
