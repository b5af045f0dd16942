/// States of a robot and the commands that change them (hardware.md 1.3, 1.4).
///
/// robot_obey() decides, drivers act: it changes the state and returns what is to be done with
/// motors, EEPROM and program. The driver's main loop then acts on the state. Nothing here touches
/// a register, reads a clock or waits.
///
/// On the chip commands come in by an interrupt: the main loop reads `state` once a pass, as one
/// byte, and all else of a robot_core_t with interrupts off.
#ifndef KILOLIB_CORE_ROBOT_COMMANDS_H
#define KILOLIB_CORE_ROBOT_COMMANDS_H

#include <stdbool.h>
#include <stdint.h>

#include "message.h"
#include "robot_answer.h"
#include "transmit_clock.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    ROBOT_IDLE,      ///< waits and blinks green; the state after power-up
    ROBOT_SETUP,     ///< RUN has come: setup(), if it never ran, then RUNNING
    ROBOT_RUNNING,   ///< loop()
    ROBOT_SLEEPING,  ///< everything off, and a look round every 8 s
    ROBOT_BATTERY,   ///< shows the battery's voltage on the LED
    ROBOT_CHARGING,  ///< blinks red while the charger is at work
    ROBOT_MOVING,    ///< turns its motors as READUID or CALIB orders
} robot_state_t;

/// Duties of the two motors, 0..255.
typedef struct {
    uint8_t left;
    uint8_t right;
} motion_t;

typedef struct {
    uint8_t state;              ///< a robot_state_t
    bool is_set_up;             ///< setup() has been called
    bool motion_is_new;         ///< of MOVING: robot_take_motion() has not fetched it yet
    motion_t motion;            ///< of MOVING
    robot_answer_t answer;      ///< to a question
    transmit_clock_t transmit;  ///< when the program is asked for a message
} robot_core_t;

/// Actions of the driver for a command. Stopping the motors makes both pins inputs, starting them
/// makes both outputs; either sets both duties to 0.
typedef enum {
    ACTION_NONE,          ///< what the state says is all
    ACTION_START_MOTORS,  ///< RUN, READUID, CALIB
    ACTION_STOP_MOTORS,   ///< the other commands
    ACTION_SAVE,          ///< stop the motors; kilolib_calibration_save() with the message's data
    ACTION_RESTART,  ///< stop the motors; go on at address 0: main() anew, memory as after power-up
    ACTION_BOOT,     ///< stop the motors; enter the boot loader
} robot_action_t;

/// A motor at rest needs full power for so long before it turns at its usual duty.
#define KICK_MS 15  ///< hardware.md 1.3
#define KICK_DUTY 255

/// Types from here on are commands to the robot, and do not reach the program.
#define FIRST_COMMAND 0x80

/// Whether a message is for the runtime, not for the program.
static inline bool message_is_command(const message_t *message) {
    return message->type >= FIRST_COMMAND;
}

/// At kilo_init(): IDLE, nothing sent yet. A robot_core_t is all zeros at power-up; is_set_up is
/// kept.
static inline void robot_core_init(robot_core_t *robot) {
    robot->state = ROBOT_IDLE;
    transmit_clock_init(&robot->transmit);
}

/// Obeys a message with a right crc that is a command; unknown types change nothing. `uid` and
/// `turn_left` are the API's variables, for READUID, questions, and a CALIB that is for one robot.
/// A question only sets `answer`. Constant time; interrupts have to be off.
robot_action_t robot_obey(robot_core_t *robot, const message_t *message, uint16_t uid,
                          uint8_t turn_left);

/// In SETUP: whether setup() is to be called now. True once.
static inline bool robot_begins_setup(robot_core_t *robot) {
    const bool first = !robot->is_set_up;
    robot->is_set_up = true;
    return first;
}

/// setup() has come back: RUNNING, unless a command has changed the state meanwhile. Interrupts
/// have to be off.
static inline void robot_end_setup(robot_core_t *robot) {
    if (robot->state == ROBOT_SETUP) robot->state = ROBOT_RUNNING;
}

/// In MOVING: whether there is a new motion. The driver then drives with robot_kick() of
/// robot->motion, waits KICK_MS, and drives with the motion itself if robot_keeps_motion(). True
/// once for each. Interrupts have to be off.
static inline bool robot_takes_motion(robot_core_t *robot) {
    const bool is_new = robot->motion_is_new;
    robot->motion_is_new = false;
    return is_new;
}

/// Duties of the kick before `motion`: full power where a motor is to turn.
static inline motion_t robot_kick(motion_t motion) {
    const motion_t kick = {(uint8_t)(motion.left != 0 ? KICK_DUTY : 0),
                           (uint8_t)(motion.right != 0 ? KICK_DUTY : 0)};
    return kick;
}

/// After the kick: whether no command has ended or changed the motion. Interrupts have to be off.
static inline bool robot_keeps_motion(const robot_core_t *robot) {
    return robot->state == ROBOT_MOVING && !robot->motion_is_new;
}

#ifdef __cplusplus
}
#endif

#endif
