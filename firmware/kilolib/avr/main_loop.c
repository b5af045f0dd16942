#include "robot.h"

#include <stdbool.h>
#include <util/atomic.h>

#include "../core/lights.h"
#include "../core/traits.h"
#include "board.h"
#include "kilolib.h"
#include "sleep.h"

#define STEP_MS 10

robot_core_t kilolib_robot;
robot_heard_t kilolib_heard;

// Ends early when a command comes; the original's does not.
static void stay(robot_state_t state) {
    if (KILOLIB_ORIGINAL) {
        delay(BLINK_OFF_MS);
        return;
    }
    for (uint8_t left = BLINK_OFF_MS / STEP_MS; left > 0 && kilolib_state() == state; left--) {
        delay(STEP_MS);
    }
}

static void blink(robot_state_t state, uint8_t color) {
    set_color(color);
    delay(BLINK_ON_MS);
    set_color(0);
    stay(state);
}

static void show_charging(void) {
    const bool charging = (PIND & CHARGING_WHEN_LOW) == 0;
    blink(ROBOT_CHARGING, charging ? CHARGING_COLOR : 0);
}

// Without a reading, since a message is being received, the LED stays as it is.
static void show_battery(void) {
    const int16_t voltage = get_voltage();
    if (voltage >= 0) set_color(battery_color(voltage));
}

static void drive(motion_t motion) { set_motors(motion.left, motion.right); }

static void move(void) {
    motion_t motion = {0, 0};
    bool is_new = false;
    set_color(0);
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        is_new = robot_takes_motion(&kilolib_robot);
        motion = kilolib_robot.motion;
        if (is_new) drive(robot_kick(motion));
    }
    if (!is_new) return;
    delay(KICK_MS);
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        if (robot_keeps_motion(&kilolib_robot)) drive(motion);
    }
}

void kilo_start(void (*setup)(void), void (*loop)(void)) {
    for (;;) {
        switch (kilolib_state()) {
        case ROBOT_IDLE: blink(ROBOT_IDLE, IDLE_COLOR); break;
        case ROBOT_SETUP:
            if (robot_begins_setup(&kilolib_robot)) setup();
            ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { robot_end_setup(&kilolib_robot); }
            break;
        case ROBOT_RUNNING:
            ORIGINAL_TAKES_LONGER(1);
            loop();
            break;
        case ROBOT_SLEEPING: kilolib_sleep_for_8_s(); break;
        case ROBOT_BATTERY: show_battery(); break;
        case ROBOT_CHARGING: show_charging(); break;
        case ROBOT_MOVING: move(); break;
        }
    }
}
