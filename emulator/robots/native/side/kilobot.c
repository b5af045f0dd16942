// The thin half of the mock Kilobot API: it is compiled into every robot's guest, so that the API's
// plain variables are swapped with the program's own.
#include <stdlib.h>

#include "../../../../firmware/kilolib/core/calibration.h"
#include "../../../../firmware/kilolib/core/pins.h"
#include "../../../../firmware/kilolib/core/random.h"
#include "../../../../firmware/kilolib/core/robot_commands.h"
#include "../../../../firmware/kilolib/core/traits.h"
#include "abi.h"
#include "kilolib.h"
#include "side.h"

volatile uint32_t kilo_ticks;
#pragma weak kilo_tx_period   // tx_period.c
#pragma weak kilo_message_tx  // message_tx.c
#pragma weak kt_sensor        // sensor.c

static void ignore_rx(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
}
static void ignore_tx_success(void) {}

message_rx_t kilo_message_rx = ignore_rx;
message_tx_success_t kilo_message_tx_success = ignore_tx_success;

// Packed types have alignment 1; the engine writes whole words.
static message_t rx_message __attribute__((aligned(4)));
static distance_measurement_t rx_distance __attribute__((aligned(4)));

const kt_table_t kt_table = {
    .abi = KT_GUEST_ABI,
    .guard_low = (uint8_t *)kt_guard_low,
    .state_begin = kt_state_begin,
    .state_end = kt_state_end,
    .guard_high = (uint8_t *)kt_guard_high,
    .program_main = kt_run_program,
    .ticks = &kilo_ticks,
    .tx_period = &kilo_tx_period,
    .uid = &kilo_uid,
    .turn_left = &kilo_turn_left,
    .save_calibration = kilolib_calibration_save,
    .message_rx = &kilo_message_rx,
    .message_tx = &kilo_message_tx,
    .message_tx_success = &kilo_message_tx_success,
    .rx_message = &rx_message,
    .rx_distance = &rx_distance,
    .outputs = &kt_outputs,
    .settle = kt_settle,
    .handlers_begin = __start_kt_handlers,
    .handlers_end = __stop_kt_handlers,
    .random = rand,
    .budget = &kt_budget,
    .host = &kt_host,
    .original = KILOLIB_ORIGINAL,
    .settled_period = &kt_settled_period,
    .sensor = kt_sensor,
};

void kilo_init(void) {
    kt_host->init();
    kilolib_calibration_load();
}
void kilo_start(void (*setup)(void), void (*loop)(void)) { kt_host->start(setup, loop); }
void delay(uint16_t ms) { kt_host->wait((uint32_t)ms * CYCLES_PER_MS); }

void set_motors(uint8_t left, uint8_t right) {
    kt_outputs.ocr2a = left;
    kt_outputs.ocr2b = right;
    kt_host->outputs();
}

void set_color(uint8_t rgb) {
    const led_pins_t on = led_pins(rgb);
    kt_outputs.ddrd = (uint8_t)((kt_outputs.ddrd & ~LED_MASK_D) | on.ddrd);
    kt_outputs.ddrc = (uint8_t)((kt_outputs.ddrc & ~LED_MASK_C) | on.ddrc);
    kt_host->outputs();
}

void spinup_motors(void) {
    set_motors(KICK_DUTY, KICK_DUTY);
    delay(KICK_MS);
}

void rand_seed(uint8_t seed) { kilolib_random_seed(seed); }

uint8_t kilolib_eeprom_read(uint16_t address) { return kt_eeprom_read(address); }

void kilolib_eeprom_update(uint16_t address, uint8_t value) { kt_eeprom_write(address, value); }

uint8_t estimate_distance(const distance_measurement_t *measured) {
    return kt_host->distance_mm(measured->low_gain, measured->high_gain);
}
