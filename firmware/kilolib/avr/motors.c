#include "motors.h"

#include "../core/pins.h"
#include "../core/robot_commands.h"
#include "board.h"
#include "kilolib.h"

// Phase-correct 8-bit pulses at 8 MHz / 8 / 510 = 1961 Hz, high for the set share.
void kilolib_motors_init(void) {
    kilolib_motors_off();
    TCCR2A = BIT(COM2A1) | BIT(COM2B1) | BIT(WGM20);
    TCCR2B = BIT(CS21);
}

void kilolib_motors_on(void) {
    set_motors(0, 0);
    DDRB |= LEFT_MOTOR_MASK;
    DDRD |= RIGHT_MOTOR_MASK;
}

void kilolib_motors_off(void) {
    DDRB &= (uint8_t)~LEFT_MOTOR_MASK;
    DDRD &= (uint8_t)~RIGHT_MOTOR_MASK;
    set_motors(0, 0);
}

void set_motors(uint8_t left, uint8_t right) {
    OCR2A = left;
    OCR2B = right;
}

void spinup_motors(void) {
    set_motors(KICK_DUTY, KICK_DUTY);
    delay(KICK_MS);
}
