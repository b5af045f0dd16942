/// module_init() and module_start(): the module's life.
#include <avr/eeprom.h>
#include <stdbool.h>

#include "answers.h"
#include "bus.h"
#include "clock.h"
#include "infrared.h"
#include "lights.h"
#include "module.h"
#include "moduleLED.h"
#include "places.h"
#include "records.h"
#include "robots.h"
#include "states.h"

#define SHOW_MS 50
#define BREATH_STEPS 20
#define BREATH_STEP_MS 70

volatile uint16_t module_uid;
volatile uint8_t module_uid_x_coord;
volatile uint8_t module_uid_y_coord;
volatile uint8_t configuration_size;
volatile uint8_t configuration[MODULE_CONFIGURATION_BUFFER_SIZE];

static bool autostart;

// A reset by the watchdog leaves it running, with 16 ms to go.
static void __attribute__((naked, used, section(".init3"))) stop_watchdog(void) {
    MCUSR = 0;
    wdt_disable();
}

// Each colour in turn, cell by cell on and off again: are all LEDs there?
static void show_lights(void) {
    static const color_t colors[] = {RED, GREEN, BLUE};
    for (uint8_t i = 0; i < sizeof colors; i++) {
        for (uint8_t cell = 0; cell < 2 * N_CELLS; cell++) {
            const bool on = cell < N_CELLS;
            set_LED((cell_num_t)(cell % N_CELLS), on ? colors[i] : LED_OFF);
            _delay_ms(SHOW_MS);
        }
    }
}

// Without a controller nobody can speak to the module: it shows that until the watchdog bites, and
// tries again.
static void despair(void) {
    wdt_enable(WDTO_8S);
    set_all_LEDs(RED);
    for (;;) {
    }
}

void module_init(void) {
    cli();
    runtime_module_state = STATE_INIT;
    module_uid_x_coord = eeprom_read_byte(PLACE(X_COORDINATE));
    module_uid_y_coord = eeprom_read_byte(PLACE(Y_COORDINATE));
    module_uid = (uint16_t)(module_uid_x_coord | module_uid_y_coord << 8);
    transfer_init(&runtime_transfer);
    runtime_lights_init();
    // Two frames that come while the lights are shown are kept, as in the published firmware.
    const bool connected = runtime_bus_init(module_uid_x_coord, module_uid_y_coord);
    show_lights();
    if (!connected) despair();
    runtime_infrared_init();
    runtime_clock_init();
    runtime_bus_listen();
    sei();
}

void module_enable_autostart(void) { autostart = true; }

uint16_t get_random(uint16_t low, uint16_t high) {
    return (uint16_t)(low + (uint16_t)rand() % (uint16_t)(high - low));
}

// A step of the light's way up and down, cut short by what the host wants.
static void breathe(void) {
    static uint8_t step;
    const uint8_t height = step <= BREATH_STEPS ? step : (uint8_t)(2 * BREATH_STEPS - step);
    set_all_LEDs_with_brightness(WHITE, (brightness_t)height);
    step = (uint8_t)((step + 1) % (2 * BREATH_STEPS));
    for (uint8_t ms = 0; ms < BREATH_STEP_MS && runtime_module_state == STATE_IDLE; ms++) {
        runtime_answer_host();
        _delay_ms(1);
    }
}

static void set_up(void (*setup)(void)) {
    if (!runtime_orders.set_up) {
        runtime_orders.set_up = true;
        setup();
    }
    if (autostart && runtime_module_state == STATE_SETUP) runtime_enter_state(STATE_RUNNING);
}

// The robots are told first.
static void run(void (*loop)(void)) {
    if (runtime_orders.started) {
        loop();
        return;
    }
    runtime_start_robots();
    runtime_records_clear();
    cli();
    runtime_orders.started = runtime_module_state == STATE_RUNNING;
    sei();
}

void module_start(void (*setup)(void), void (*loop)(void)) {
    wdt_enable(WDTO_8S);
    runtime_enter_state(autostart ? STATE_SETUP : STATE_IDLE);
    for (;;) {
        wdt_reset();
        switch (runtime_module_state) {
        case STATE_IDLE: breathe(); break;
        case STATE_SETUP_KILOBOTS: runtime_repeat_message(); break;
        case STATE_BOOTLOADING_KILOBOTS:
            if (runtime_orders.page) runtime_send_page();
            break;
        case STATE_SETUP: set_up(setup); break;
        case STATE_RUNNING: run(loop); break;
        default: break;
        }
        runtime_send_broadcast();
        runtime_answer_host();
    }
}
