// Goes wrong in one of three ways, as HOW says.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

int main(void) {
#if HOW == 0
    __asm__ volatile(".word 0x0001");
#elif HOW == 1
    *(volatile uint8_t *)0x2345 = 1;
#else
    cli();
    sleep_mode();
#endif
    for (;;) {
    }
}
