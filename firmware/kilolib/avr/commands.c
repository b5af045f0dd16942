#include "commands.h"

#include "../core/calibration.h"
#include "../core/traits.h"
#include "clock.h"
#include "kilolib.h"
#include "motors.h"
#include "robot.h"

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

void kilolib_command_obey(message_t *message) {
    if (KILOLIB_ORIGINAL && !original_knows(message)) return;
    const robot_action_t action = robot_obey(&kilolib_robot, message, kilo_uid, kilo_turn_left);
    if (action == ACTION_START_MOTORS) kilolib_motors_on();
    if (action < ACTION_STOP_MOTORS) return;
    kilolib_motors_off();
    if (action == ACTION_RESTART) start_again();
    if (action == ACTION_BOOT) enter_boot_loader();
    if (action == ACTION_SAVE) kilolib_calibration_save(message->data);
}
