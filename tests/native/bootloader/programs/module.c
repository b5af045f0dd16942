/// A module's program without any runtime, some pages long: says N again and again on its serial
/// line.
#include <avr/io.h>
#include <avr/pgmspace.h>

#define LINE "Each page of it has to be right: N is said only if the text is. "
#define LINES LINE LINE LINE LINE
static const char text[] PROGMEM = LINES LINES LINES LINES;

int main(void) {
    UBRR0 = 12;
    UCSR0B = 1 << TXEN0;
    for (uint16_t i = 0;; i = (uint16_t)((i + 1) % (sizeof text - 1))) {
        while ((UCSR0A & 1 << UDRE0) == 0) {
        }
        UDR0 = pgm_read_byte(&text[i]) < 0x7F ? 'N' : '?';
    }
}
