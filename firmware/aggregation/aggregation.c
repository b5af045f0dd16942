/// Connects the machine of pfsm.h to the Kilobot API.
#include <kilolib.h>
#include <stdbool.h>
#include <stddef.h>

#include "neighbours.h"
#include "params.h"
#include "pfsm.h"
#include "tracking.h"
#include "wire.h"

// loop() not called for so long means that the robot was paused.
#define PAUSE_TICKS 4
#define NO_COLOUR 0xFF

static params_t params;
static neighbours_t neighbours;
static pfsm_t machine;
static tracking_t tracking;
static message_t signal_message;
static message_t report_message;

// Shared with the callbacks, which interrupt loop(): single bytes only. Site and flags of two
// CELL messages may get mixed up; the next tick puts that right.
static volatile uint8_t site;
static volatile uint8_t flags = PFSM_FLOOR_UNKNOWN;
static volatile bool running;
static volatile bool signalling;
static volatile bool report_due;      // report_message is whole, and not sent yet
static volatile bool report_offered;  // what was asked for last is the report

// The present state of LED and motors.
static uint8_t left_motor;
static uint8_t right_motor;
static uint8_t colour = NO_COLOUR;

static uint32_t last_tick;

// An interrupt counts the four bytes of kilo_ticks up, perhaps between our reads of them.
static uint32_t ticks_now(void) {
    uint32_t now = kilo_ticks;
    while (now != kilo_ticks) now = kilo_ticks;
    return now;
}

static bool is_mine(wire_config_t config) {
    return config.uid_first <= kilo_uid && kilo_uid <= config.uid_last;
}

// The floor's last word holds until the next one, however long that takes.
static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)distance;
    if (message->type == WIRE_TYPE_SIGNAL) {
        if (running) neighbours_heard(&neighbours, wire_get_signal(message->data), kilo_ticks);
    } else if (message->type == WIRE_TYPE_CELL) {
        const wire_cell_t cell = wire_get_cell(message->data);
        site = cell.site;
        flags = cell.flags & (WIRE_CELL_WALL | WIRE_CELL_OBSTACLE);
    } else if (message->type == WIRE_TYPE_CONFIG && !running) {
        const wire_config_t config = wire_get_config(message->data);
        if (is_mine(config)) params_set(&params, config.key, config.value);
    }
}

// A report goes before a signal, of which there are four in its time.
static message_t *report_signal_or_silence(void) {
    report_offered = report_due;
    if (report_due) return &report_message;
    return signalling ? &signal_message : NULL;
}

static void on_sent(void) {
    if (report_offered) report_due = false;
}

// A motor needs a push to start, unless it starts at full power anyway.
static bool needs_push(uint8_t from, uint8_t to) { return from == 0 && to > 0 && to < 255; }

static void drive(uint8_t left, uint8_t right) {
    if (left == left_motor && right == right_motor) return;
    if (needs_push(left_motor, left) || needs_push(right_motor, right)) spinup_motors();
    set_motors(left, right);
    left_motor = left;
    right_motor = right;
}

static void move(uint8_t motion) {
    switch (motion) {
    case WALK_STRAIGHT: drive(kilo_straight_left, kilo_straight_right); break;
    case WALK_LEFT: drive(kilo_turn_left, 0); break;
    case WALK_RIGHT: drive(0, kilo_turn_right); break;
    default: drive(0, 0);
    }
}

// Red, for avoiding, is a way of walking, so that the colours tell the machine's states apart:
// off and red are the random walk, both whites are on a site, green (the faintest) is leaving.
static uint8_t colour_of(const pfsm_t *m) {
    switch (m->state) {
    case PFSM_ENTER: return RGB(1, 1, 1);
    case PFSM_REST: return RGB(3, 3, 3);
    case PFSM_LEAVE: return RGB(0, 1, 0);
    default: return m->walk.avoiding ? RGB(1, 0, 0) : RGB(0, 0, 0);
    }
}

static void show(void) {
    signalling = pfsm_signals(&machine, &params);
    move(machine.walk.motion);
    const uint8_t wanted = colour_of(&machine);
    if (wanted != colour) set_color(wanted);
    colour = wanted;
}

// A report that could not be sent in a whole period is left behind.
static void report(uint32_t now) {
    if (!tracking_due(&tracking, &params, now)) return;
    report_due = false;
    wire_put_tracking(report_message.data,
                      (wire_tracking_t){kilo_uid, colour, {site, flags}, tracking.number});
    report_message.crc = message_crc(&report_message);
    // The compiler must not write the message after this.
    __asm__ volatile("" ::: "memory");
    report_due = true;
}

static void setup(void) {
    uint32_t seed = 0;
    for (uint8_t i = 0; i < 4; i++) seed = seed << 8 | rand_hard();

    wire_put_signal(signal_message.data, kilo_uid);
    signal_message.type = WIRE_TYPE_SIGNAL;
    signal_message.crc = message_crc(&signal_message);
    report_message.type = WIRE_TYPE_TRACKING;

    const uint32_t now = ticks_now();
    neighbours_init(&neighbours, params.CAPACITY, params.TIMEOUT_TICKS);
    pfsm_init(&machine, &params, now, seed, kilo_uid);
    tracking_init(&tracking, &params, now, kilo_uid);
    last_tick = now - 1;
    running = true;
}

// A pause has switched motors and LED off behind our back.
static void resume(void) {
    left_motor = right_motor = 0;
    colour = NO_COLOUR;
    show();
}

static void loop(void) {
    const uint32_t now = ticks_now();
    const uint32_t passed = now - last_tick;
    if (passed == 0) return;
    last_tick = now;
    if (passed > PAUSE_TICKS) resume();

    const pfsm_floor_t floor = {site, flags};
    if (pfsm_step(&machine, &params, &neighbours, now, floor)) show();
    if (params.TRACKING_TICKS > 0) report(now);
}

// The callbacks come first: kilo_init() switches the interrupts on, and CONFIG may be on air.
int main(void) {
    params_reset(&params);
    kilo_message_rx = on_message;
    kilo_message_tx = report_signal_or_silence;
    kilo_message_tx_success = on_sent;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
