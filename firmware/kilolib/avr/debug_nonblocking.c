#define DEBUG
#define NONBLOCKING
#include <avr/interrupt.h>
#include <stdbool.h>
#include <stdint.h>

#include "debug.h"
#include "uart.h"

// A power of two, so that an index wraps by a mask.
#define QUEUE_SIZE 128

static char queue[QUEUE_SIZE];
static volatile uint8_t first;  // written by the interrupt
static volatile uint8_t end;    // written by put()

static uint8_t after(uint8_t index) { return (uint8_t)(index + 1) & (QUEUE_SIZE - 1); }

// Bytes that do not fit any more are lost.
static int put(char character, FILE *stream) {
    (void)stream;
    const uint8_t next = after(end);
    if (next == first) return EOF;
    queue[end] = character;
    end = next;
    UCSR0B |= BIT(UDRIE0);
    return 0;
}

// put() may have switched it on for a character that has just gone.
ISR(USART_UDRE_vect) {
    if (first == end) {
        UCSR0B &= (uint8_t)~BIT(UDRIE0);
        return;
    }
    UDR0 = (uint8_t)queue[first];
    first = after(first);
}

static FILE line = FDEV_SETUP_STREAM(put, NULL, _FDEV_SETUP_WRITE);

void debug_init_nonblocking(void) {
    uart_init();
    stdout = &line;
}
