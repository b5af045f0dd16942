#define DEBUG
#include "debug.h"

#include <stdint.h>

#include "uart.h"

static int put(char character, FILE *stream) {
    (void)stream;
    while (!(UCSR0A & BIT(UDRE0))) {
    }
    UDR0 = (uint8_t)character;
    return 0;
}

static FILE line = FDEV_SETUP_STREAM(put, NULL, _FDEV_SETUP_WRITE);

void debug_init(void) {
    uart_init();
    stdout = &line;
}
