#include "receiver.h"

#include <avr/interrupt.h>
#include <stddef.h>
#include <stdint.h>

#include "../../kilolib/avr/board.h"
#include "../../kilolib/avr/infrared_receive.h"
#include "../../kilolib/core/infrared_frame.h"
#include "clock.h"

#define QUEUE_LENGTH 16  // a power of two

static infrared_reader_t reader;
static message_t queue[QUEUE_LENGTH];
// The interrupt puts at `head`, the main program takes at `tail`; equal: nothing is there.
static volatile uint8_t head, tail;

// As kilolib's receiver (kilolib/avr/infrared_receive.c), without the converter.
void receiver_init(void) {
    TCCR1B = BIT(ICES1) | BIT(CS10);
    DIDR1 = BIT(AIN0D) | BIT(AIN1D);
    infrared_reader_reset(&reader);
    ACSR = BIT(ACI) | BIT(ACIC) | BIT(ACIE) | BIT(ACIS1) | BIT(ACIS0);
}

bool receiver_in_frame(void) { return reader.receiving; }

// The only edge that can wait is the robot's own light.
void kilolib_infrared_forget_edge(void) { ACSR |= BIT(ACI); }

static uint8_t behind(uint8_t place) { return (uint8_t)((place + 1) & (QUEUE_LENGTH - 1)); }

const message_t *receiver_oldest(void) { return tail != head ? &queue[tail] : NULL; }

// The compiler may not read the message later than this.
void receiver_drop_oldest(void) {
    __asm__ volatile("" ::: "memory");
    tail = behind(tail);
}

ISR(ANALOG_COMP_vect) {
    const infrared_edge_t edge = infrared_reader_edge(&reader, ICR1);
    OCR1A = reader.byte_start + BYTE_TIMEOUT;
    if (edge == EDGE_BEGINS) {
        TIFR1 = BIT(OCF1A);
        TIMSK1 = BOOT_WAKES | BIT(OCIE1A);
    }
    if (!reader.receiving) TIMSK1 = BOOT_WAKES;
    if (edge != EDGE_COMPLETES || behind(head) == tail) return;
    queue[head] = reader.message;
    head = behind(head);
}

// The next edge did not come in time.
ISR(TIMER1_COMPA_vect) {
    infrared_reader_reset(&reader);
    TIMSK1 = BOOT_WAKES;
}
