#include "kilolib.h"

#include <avr/interrupt.h>
#include <avr/wdt.h>
#include <stddef.h>

#include "board.h"
#include "calibration.h"
#include "clock.h"
#include "motors.h"
#include "power.h"
#include "states.h"

static void ignore_rx(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
}
static message_t *ignore_tx(void) { return NULL; }
static void ignore_tx_success(void) {}

message_rx_t kilo_message_rx = ignore_rx;
message_tx_t kilo_message_tx = ignore_tx;
message_tx_success_t kilo_message_tx_success = ignore_tx_success;

void kilo_init(void) {
    cli();
    // It may be running: RESET comes at any time, and only a power-up stops it by itself.
    MCUSR &= (uint8_t)~BIT(WDRF);
    wdt_disable();
    robot_state = STATE_IDLE;
    calibration_load();
    power_on();
    motors_init();
    clock_init();
    sei();
}
