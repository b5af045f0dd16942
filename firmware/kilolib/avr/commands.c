#include "commands.h"

#include <stdbool.h>

#include "calibration.h"
#include "clock.h"
#include "kilolib.h"
#include "motors.h"
#include "states.h"

// The boot section is there whatever the program is. An absolute jump: a call through a pointer
// would take this number for a count of words.
#define BOOT_LOADER "0x7000"

static void __attribute__((noreturn)) enter_boot_loader(void) {
    kilolib_clock_stop();
    __asm__ volatile("jmp " BOOT_LOADER);
    __builtin_unreachable();
}

// The start-up code makes stack and memory new, and kilo_init() all that it uses of the chip.
static void __attribute__((noreturn)) start_again(void) {
    __asm__ volatile("jmp 0");
    __builtin_unreachable();
}

// A robot that is running goes on.
static void run(void) {
    if (kilolib_robot_state == STATE_SETUP || kilolib_robot_state == STATE_RUNNING) return;
    kilolib_motors_on();
    kilolib_robot_state = STATE_SETUP;
}

static void show_uid_bit(uint8_t bit) {
    const bool set = bit < 16 && (kilo_uid >> bit & 1) != 0;
    kilolib_start_moving((motion_t){set ? kilo_turn_left : 0, 0});
}

static void calibrate(const calibration_t *values) {
    switch (values->mode) {
    case CALIBRATION_SAVE:
        // Only after a trial.
        if (kilolib_robot_state != STATE_MOVING) return;
        kilolib_motors_off();
        kilolib_calibration_save(values);
        kilolib_robot_state = STATE_IDLE;
        return;
    case CALIBRATION_UID: kilolib_start_moving((motion_t){0, 0}); return;
    case CALIBRATION_TURN_LEFT: kilolib_start_moving((motion_t){values->turn_left, 0}); return;
    case CALIBRATION_TURN_RIGHT: kilolib_start_moving((motion_t){0, values->turn_right}); return;
    case CALIBRATION_STRAIGHT:
        kilolib_start_moving((motion_t){values->straight_left, values->straight_right});
        return;
    default: return;
    }
}

static void stop_and_enter(robot_state_t state) {
    kilolib_motors_off();
    kilolib_robot_state = state;
}

void kilolib_command_obey(const message_t *message) {
    switch ((message_type_t)message->type) {
    case RUN: run(); break;
    case READUID: show_uid_bit(message->data[0]); break;
    case CALIB: calibrate((const calibration_t *)message->data); break;
    case WAKEUP: stop_and_enter(STATE_IDLE); break;
    case SLEEP: stop_and_enter(STATE_SLEEPING); break;
    case CHARGE: stop_and_enter(STATE_CHARGING); break;
    case VOLTAGE: stop_and_enter(STATE_BATTERY); break;
    case RESET: kilolib_motors_off(); start_again();
    case BOOT: kilolib_motors_off(); enter_boot_loader();
    default: break;
    }
}
