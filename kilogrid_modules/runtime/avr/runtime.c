/// module_init() and module_start(): the main loop of a module.
#include <avr/eeprom.h>
#include <stdbool.h>
#include <util/atomic.h>

#include "../core/api.h"
#include "../core/eeprom_map.h"
#include "../core/light_patterns.h"
#include "bus.h"
#include "can_messages.h"
#include "clock.h"
#include "commands.h"
#include "infrared.h"
#include "lights.h"
#include "module.h"
#include "moduleLED.h"
#include "records.h"
#include "robots.h"

volatile uint16_t module_uid;
volatile uint8_t module_uid_x_coord;
volatile uint8_t module_uid_y_coord;
volatile uint8_t configuration_size;
volatile uint8_t configuration[MODULE_CONFIGURATION_BUFFER_SIZE];

// A reset by the watchdog leaves it running, with 16 ms to go.
static void __attribute__((naked, used, section(".init3"))) stop_watchdog(void) {
    MCUSR = 0;
    wdt_disable();
}

static void show_lights(void) {
    for (uint8_t step = 0; step < SHOW_STEPS; step++) {
        const uint8_t cell = pattern_show_cell(step);
        set_LED((cell_num_t)cell, (color_t)pattern_show_color(step, cell));
        _delay_ms(SHOW_STEP_MS);
    }
}

// A module without a CAN controller cannot be reached: it shows red until the watchdog resets it,
// and tries again.
static void stay_unconnected(void) {
    wdt_enable(WDTO_8S);
    set_all_LEDs(RED);
    for (;;) {
    }
}

void module_init(void) {
    cli();
    orders_init(&runtime_orders);
    module_uid_x_coord = eeprom_read_byte(EEPROM_AT(EEPROM_X));
    module_uid_y_coord = eeprom_read_byte(EEPROM_AT(EEPROM_Y));
    module_uid = (uint16_t)(module_uid_x_coord | module_uid_y_coord << 8);
    runtime_lights_init();
    // Two frames that come while the lights are shown are kept, as in the published firmware.
    const bool connected = runtime_bus_init(module_uid_x_coord, module_uid_y_coord);
    show_lights();
    if (!connected) stay_unconnected();
    runtime_infrared_init();
    runtime_clock_init();
    runtime_bus_listen();
    sei();
}

void module_enable_autostart(void) { runtime_orders.autostart = true; }

uint16_t get_random(uint16_t low, uint16_t high) { return api_in_range(low, high, rand()); }

// A step of the breathing pattern, cut short by an order or a question to robots. Answers do not
// wait for its end.
static void breathe(void) {
    static uint8_t step;
    set_all_LEDs_with_brightness(WHITE, (brightness_t)pattern_breath(step));
    step = (uint8_t)((step + 1) % BREATH_STEPS);
    for (uint8_t ms = 0; ms < BREATH_STEP_MS && main_loop_job(&runtime_orders) == JOB_BREATHE;
         ms++) {
        runtime_answer_host();
        _delay_ms(1);
    }
}

static void set_up(void (*setup)(void)) {
    if (orders_begin_setup(&runtime_orders)) setup();
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { orders_end_setup(&runtime_orders); }
}

static void begin(void) {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { orders_begin(&runtime_orders); }
}

// Records from before the run are not the run's.
static void start_robots(void) {
    runtime_send_burst(JOB_START_ROBOTS);
    record_store_clear(&runtime_records);
}

// The watchdog is fed once a round: a job that hangs resets the module.
void module_start(void (*setup)(void), void (*loop)(void)) {
    wdt_enable(WDTO_8S);
    for (;;) {
        wdt_reset();
        const job_t job = main_loop_job(&runtime_orders);
        switch (job) {
        case JOB_BEGIN: begin(); break;
        case JOB_BREATHE: breathe(); break;
        case JOB_REPEAT:
        case JOB_ASK_ROBOTS:
        case JOB_SEND_PAGE: runtime_send_burst(job); break;
        case JOB_SET_UP: set_up(setup); break;
        case JOB_START_ROBOTS: start_robots(); break;
        case JOB_LOOP: loop(); break;
        default: break;
        }
        runtime_send_broadcast();
        runtime_answer_host();
    }
}
