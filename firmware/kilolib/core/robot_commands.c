#include "robot_commands.h"

#include "calibration.h"
#include "gains.h"

#define UID_BITS 16

// The program that is running goes on.
static robot_action_t run(robot_core_t *robot) {
    if (robot->state == ROBOT_SETUP || robot->state == ROBOT_RUNNING) return ACTION_NONE;
    robot->state = ROBOT_SETUP;
    return ACTION_START_MOTORS;
}

// Only after a trial.
static robot_action_t save(robot_core_t *robot) {
    if (robot->state != ROBOT_MOVING) return ACTION_NONE;
    robot->state = ROBOT_IDLE;
    return ACTION_SAVE;
}

// Controllers repeat their commands: the same motion again does not kick again.
static robot_action_t start_moving(robot_core_t *robot, motion_t motion) {
    robot_action_t action = ACTION_START_MOTORS;
    if (robot->state == ROBOT_MOVING) {
        if (robot->motion.left == motion.left && robot->motion.right == motion.right)
            return ACTION_NONE;
        action = ACTION_NONE;
    }
    robot->state = ROBOT_MOVING;
    robot->motion_is_new = true;
    robot->motion = motion;
    return action;
}

// READUID: a turn to the left stands for a bit that is set.
static motion_t uid_motion(uint8_t bit, uint16_t uid, uint8_t turn_left) {
    motion_t motion = {0, 0};
    if (bit < UID_BITS && (uid >> bit & 1) != 0) motion.left = turn_left;
    return motion;
}

// CALIB: the motion that its mode tries.
static motion_t trial_motion(const uint8_t *data) {
    motion_t motion = {0, 0};
    switch (data[CALIB_MODE]) {
    case CALIBRATION_TURN_LEFT: motion.left = data[CALIB_TURN_LEFT]; break;
    case CALIBRATION_TURN_RIGHT: motion.right = data[CALIB_TURN_RIGHT]; break;
    case CALIBRATION_STRAIGHT:
        motion.left = data[CALIB_STRAIGHT_LEFT];
        motion.right = data[CALIB_STRAIGHT_RIGHT];
        break;
    default: break;
    }
    return motion;
}

// Without the mark it is for every robot (calibration.h).
static bool is_marked(const uint8_t *data) {
    return data[CALIB_MARK] == CALIB_MARK_LOW && data[CALIB_MARK + 1] == CALIB_MARK_HIGH;
}

static bool is_of(const uint8_t *data, uint16_t uid) {
    return data[CALIB_UID_LOW] == (uint8_t)uid && data[CALIB_UID_HIGH] == (uint8_t)(uid >> 8);
}

// A program that runs is not held up for as long as writing takes, nor is a robot woken.
static robot_action_t save_gains(robot_core_t *robot) {
    if (robot->state != ROBOT_IDLE && robot->state != ROBOT_MOVING) return ACTION_NONE;
    robot->state = ROBOT_IDLE;
    return ACTION_SAVE;
}

// Both move the robot, one motion at a time, until another command comes.
static robot_action_t calibrate_or_show(robot_core_t *robot, const message_t *message, uint16_t uid,
                                        uint8_t turn_left) {
    const uint8_t *data = message->data;
    motion_t motion;
    if (message->type == READUID) {
        motion = uid_motion(data[0], uid, turn_left);
    } else {
        const uint8_t mode = data[CALIB_MODE];
        const bool is_for_all = !is_marked(data);
        if (!is_for_all && !is_of(data, uid)) return ACTION_NONE;
        if (mode == CALIBRATION_SAVE) return save(robot);
        if (mode > CALIBRATION_STRAIGHT) {
            if (is_for_all || mode < CALIBRATION_GAINS || mode >= CALIBRATION_GAINS + GAIN_ENTRIES)
                return ACTION_NONE;
            return save_gains(robot);
        }
        motion = trial_motion(data);
    }
    return start_moving(robot, motion);
}

// A robot that looks round in its sleep goes down again before the slot.
static robot_action_t take_question(robot_core_t *robot, const message_t *message, uint16_t uid) {
    if (robot->state != ROBOT_SLEEPING) robot_answer_take(&robot->answer, message->data, uid);
    return ACTION_NONE;
}

// Commands that stop the motors do so in any state, also in the one that they lead to.
robot_action_t robot_obey(robot_core_t *robot, const message_t *message, uint16_t uid,
                          uint8_t turn_left) {
    robot_state_t next;
    switch (message->type) {
    case RUN: return run(robot);
    case READUID:
    case CALIB: return calibrate_or_show(robot, message, uid, turn_left);
    case RESET: return ACTION_RESTART;
    case BOOT: return ACTION_BOOT;
    case BOOTPGM_QUERY: return take_question(robot, message, uid);
    case WAKEUP: next = ROBOT_IDLE; break;
    case SLEEP:
        robot_answer_end(&robot->answer);
        next = ROBOT_SLEEPING;
        break;
    case CHARGE: next = ROBOT_CHARGING; break;
    case VOLTAGE: next = ROBOT_BATTERY; break;
    default: return ACTION_NONE;
    }
    robot->state = (uint8_t)next;
    return ACTION_STOP_MOTORS;
}
