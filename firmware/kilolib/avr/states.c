#include "states.h"

#include <stdbool.h>
#include <util/atomic.h>

#include "board.h"
#include "kilolib.h"
#include "motors.h"
#include "sleep.h"

#define PAUSE_MS 200
#define STEP_MS 10
#define KICK 255
#define KICK_MS 15
// Least readings of the voltage for the colours.
#define BATTERY_GREEN 683
#define BATTERY_BLUE 649
#define BATTERY_YELLOW 615

volatile robot_state_t kilolib_robot_state;

static motion_t motion;
static volatile bool motion_is_new;

void kilolib_start_moving(motion_t next) {
    const bool same = motion.left == next.left && motion.right == next.right;
    if (kilolib_robot_state == STATE_MOVING && same) return;
    if (kilolib_robot_state != STATE_MOVING) kilolib_motors_on();
    motion = next;
    motion_is_new = true;
    kilolib_robot_state = STATE_MOVING;
}

// Ends early when a command comes.
static void stay(robot_state_t state) {
    for (uint8_t left = PAUSE_MS / STEP_MS; left > 0 && kilolib_robot_state == state; left--) {
        delay(STEP_MS);
    }
}

static void blink(robot_state_t state, uint8_t color) {
    set_color(color);
    delay(1);
    set_color(0);
    stay(state);
}

static void show_charging(void) {
    const bool charging = (PIND & CHARGING_WHEN_LOW) == 0;
    blink(STATE_CHARGING, charging ? RGB(1, 0, 0) : 0);
}

// Without a reading, since a message is coming in, the LED stays as it is.
static void show_battery(void) {
    const int16_t voltage = get_voltage();
    if (voltage < 0) return;
    if (voltage >= BATTERY_GREEN) {
        set_color(RGB(0, 3, 0));
    } else if (voltage >= BATTERY_BLUE) {
        set_color(RGB(0, 0, 3));
    } else if (voltage >= BATTERY_YELLOW) {
        set_color(RGB(3, 3, 0));
    } else {
        set_color(RGB(3, 0, 0));
    }
}

// A motor at rest needs a kick to begin to turn.
static void move(void) {
    motion_t now = {0, 0};
    bool kick;
    set_color(0);
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        kick = motion_is_new;
        motion_is_new = false;
        now = motion;
        if (kick) set_motors(now.left ? KICK : 0, now.right ? KICK : 0);
    }
    if (!kick) return;
    delay(KICK_MS);
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        if (kilolib_robot_state == STATE_MOVING && !motion_is_new) set_motors(now.left, now.right);
    }
}

void kilo_start(void (*setup)(void), void (*loop)(void)) {
    bool is_set_up = false;
    for (;;) {
        switch (kilolib_robot_state) {
        case STATE_IDLE: blink(STATE_IDLE, RGB(0, 3, 0)); break;
        case STATE_SETUP:
            if (!is_set_up) setup();
            is_set_up = true;
            // A command may have come while setup() ran.
            ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
                if (kilolib_robot_state == STATE_SETUP) kilolib_robot_state = STATE_RUNNING;
            }
            break;
        case STATE_RUNNING: loop(); break;
        case STATE_SLEEPING: kilolib_sleep_for_8_s(); break;
        case STATE_BATTERY: show_battery(); break;
        case STATE_CHARGING: show_charging(); break;
        case STATE_MOVING: move(); break;
        }
    }
}
