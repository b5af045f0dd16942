// An application and, in the boot section, a loader, as the Kilobot has them: the application calls
// word address 0x7000, which the program counter's 14 bits make byte 0x6000; through erased flash
// it slides to 0x7000. The loader moves the vectors, counts timer interrupts by its own handler,
// and programs a page.
#include <avr/boot.h>
#include <avr/interrupt.h>
#include <avr/io.h>

volatile uint8_t application_interrupts, boot_interrupts, programmed;

ISR(TIMER0_COMPA_vect) { application_interrupts++; }

__attribute__((section(".bootvectors"), used, naked)) void boot_vectors(void) {
    __asm__ volatile("jmp boot_main\n"
                     ".rept 13\n jmp boot_main\n .endr\n"
                     "jmp __vector_of_loader\n");
}

__attribute__((section(".bootloader"), used, signal)) void __vector_of_loader(void) {
    boot_interrupts++;
}

__attribute__((section(".bootloader"), used, noreturn)) void boot_main(void) {
    cli();
    MCUCR = 1 << IVCE;
    MCUCR = 1 << IVSEL;
    sei();
    while (boot_interrupts < 3) {
    }
    cli();
    boot_page_erase(0x4000);
    boot_spm_busy_wait();
    for (uint8_t i = 0; i < SPM_PAGESIZE; i += 2) boot_page_fill(0x4000 + i, 0x5A00 + i);
    boot_page_write(0x4000);
    boot_spm_busy_wait();
    boot_rww_enable();
    programmed = 1;
    for (;;) {
    }
}

int main(void) {
    OCR0A = 10;
    TCCR0A = 1 << WGM01;
    TCCR0B = 1 << CS01;
    TIMSK0 = 1 << OCIE0A;
    sei();
    while (application_interrupts < 3) {
    }
    ((void (*)(void))0x7000)();
}
