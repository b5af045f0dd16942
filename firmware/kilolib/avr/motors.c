#include "motors.h"

#include "board.h"
#include "kilolib.h"

#define SPINUP_MS 15

// Phase-correct 8-bit pulses at 8 MHz / 8 / 510 = 1961 Hz, high for the set share.
void kilolib_motors_init(void) {
    kilolib_motors_off();
    TCCR2A = BIT(COM2A1) | BIT(COM2B1) | BIT(WGM20);
    TCCR2B = BIT(CS21);
}

void kilolib_motors_on(void) {
    set_motors(0, 0);
    DDRB |= LEFT_MOTOR;
    DDRD |= RIGHT_MOTOR;
}

void kilolib_motors_off(void) {
    DDRB &= (uint8_t)~LEFT_MOTOR;
    DDRD &= (uint8_t)~RIGHT_MOTOR;
    set_motors(0, 0);
}

void set_motors(uint8_t left, uint8_t right) {
    OCR2A = left;
    OCR2B = right;
}

void spinup_motors(void) {
    set_motors(255, 255);
    delay(SPINUP_MS);
}
