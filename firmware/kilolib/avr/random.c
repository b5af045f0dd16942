#include <avr/interrupt.h>
#include <stdbool.h>
#include <util/atomic.h>

#include "board.h"
#include "converter.h"
#include "infrared_receive.h"
#include "kilolib.h"

#define TRIES_PER_BIT 128

static uint8_t state = 0xAA;
static uint8_t accumulator;

// An 8-bit xorshift and a counter that seeding leaves alone (hardware.md 1.7).
uint8_t rand_soft(void) {
    state ^= (uint8_t)(state << 3);
    state ^= state >> 5;
    state ^= accumulator >> 2;
    accumulator++;
    return state;
}

void rand_seed(uint8_t seed) { state = seed; }

static bool interrupts_on(void) { return (SREG & BIT(SREG_I)) != 0; }

// The lowest bit of the battery voltage. A frame just beginning needs the converter for itself, 0.4
// ms at most.
static uint8_t noise(void) {
    while (infrared_measuring() && interrupts_on()) {
    }
    uint8_t bit = 0;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { bit = converter_read(BATTERY_CHANNEL) & 1; }
    return bit;
}

// Of two bits that differ the first is 0 as often as 1, however often each bit alone is 1.
static uint8_t fair_bit(void) {
    for (uint8_t tries = 0; tries < TRIES_PER_BIT; tries++) {
        const uint8_t first = noise();
        if (first != noise()) return first;
    }
    return 0;
}

uint8_t rand_hard(void) {
    uint8_t bits = 0;
    for (uint8_t i = 0; i < 8; i++) bits = (uint8_t)(bits << 1) | fair_bit();
    return bits;
}
