#include "kilolib.h"

#include <avr/interrupt.h>
#include <stddef.h>

#include "../core/calibration.h"
#include "../core/eeprom_map.h"
#include "clock.h"
#include "motors.h"
#include "power.h"
#include "robot.h"
#include "watchdog.h"

#define ERASED 0xFF

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
    watchdog_stop();  // RESET may have come while it ran
    robot_core_init(&kilolib_robot);
    // An oscillator that was never measured keeps the factory's tuning.
    const uint8_t osccal = kilolib_eeprom_read(EEPROM_OSCCAL);
    if (osccal != ERASED) OSCCAL = osccal;
    kilolib_calibration_load();
    kilolib_power_on();
    kilolib_motors_init();
    kilolib_clock_init();
    sei();
}
