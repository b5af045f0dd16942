// Messages to a native robot: its program's, commands, and the states that these lead to.
#include <algorithm>
#include <cstring>

#include "kilolib/core/calibration.h"
#include "kilolib/core/robot_query.h"
#include "kilolib/core/sleep_rhythm.h"
#include "kilolib/core/traits.h"
#include "robots/native/robot.h"

namespace kilotwin {

namespace {

// About what an AVR takes from address 0 to main(); it keeps a main() that jumps there from
// standing still in time.
constexpr uint32_t RESTART_CYCLES = CYCLES_PER_SECOND / 1000;

}  // namespace

// Before kilo_init() the receiver is off.
bool NativeRobot::receives(const Reception &reception) {
    if (interrupts_off_) return false;
    if (robot_.core.state == ROBOT_SLEEPING)
        return sleep_rhythm_receives(state_since_, &acts_at_, reception.at - FRAME_CYCLES);
    return robot_.next_tick != NEVER;
}

// There is no boot loader: BOOT leaves the robot in IDLE.
void NativeRobot::obey(const message_t &message) {
    const auto before = static_cast<robot_state_t>(robot_.core.state);
    const auto &table = program_->table();
    const auto action = robot_obey(&robot_.core, &message, *table.uid, *table.turn_left);
    if (action == ACTION_NONE) return;
    switch_motors(action == ACTION_START_MOTORS);
    switch (action) {
    case ACTION_SAVE: save_calibration(message); break;
    case ACTION_BOOT:
        robot_.core.state = ROBOT_IDLE;
        note(HAS_NO_LOADER, "it runs natively and has no boot loader, so that BOOT leaves it idle; "
                            "robots with cpu = \"avr\" can be flashed");
        break;
    case ACTION_RESTART: start_again(); stack().abandon();
    default: break;
    }
    if (robot_.core.state != before) enter_state(before);
}

// The original blinks to the end first, also if other commands come meanwhile.
Cycles NativeRobot::main_loop_sees(robot_state_t before) const {
    if (robot_.core.state == ROBOT_SLEEPING) return robot_.now;
    if (acts_at_ > robot_.now && before != ROBOT_SLEEPING) return acts_at_;
    const bool blinks = before == ROBOT_IDLE || before == ROBOT_CHARGING;
    if (table().original == 0 || !blinks) return robot_.now;
    return state_since_ + original_looks_after(robot_.now - state_since_);
}

// While a robot sleeps its timer stands still. All states but SETUP use the LED for themselves.
void NativeRobot::enter_state(robot_state_t before) {
    acts_at_ = main_loop_sees(before);
    state_since_ = robot_.now;
    loop_due_ = robot_.core.state == ROBOT_SETUP || robot_.core.state == ROBOT_MOVING;
    if (before == ROBOT_SLEEPING) robot_.next_tick = robot_.now + robot_.tick_length;
    if (robot_.core.state == ROBOT_SLEEPING) robot_.next_tick = NEVER;
    if (robot_.core.state != ROBOT_SETUP) switch_led_off();
}

// MOVING: the motors concerned are kicked, then turn as ordered until the next command.
void NativeRobot::start_motion() {
    robot_takes_motion(&robot_.core);
    const motion_t motion = robot_.core.motion;
    set_duties(robot_kick(motion));
    wait_until(robot_.now + KICK_MS * CYCLES_PER_MS);
    if (robot_keeps_motion(&robot_.core)) set_duties(motion);
}

void NativeRobot::save_calibration(const message_t &message) {
    table().save_calibration(message.data);
    robot_.calibration.uid = *table().uid;
}

// kilolib_calibration_gains() of what the EEPROM holds, which is the engine's here.
void NativeRobot::gains_saved(uint8_t which, uint8_t *content) const {
    for (uint8_t byte = 0; byte < REPORT_CONTENT; byte++)
        content[byte] =
            eeprom(eeprom_gain_place(static_cast<uint8_t>(which - CALIBRATION_GAINS), byte));
}

// As firmware/kilolib/avr/gains_read.c. What was saved since does not change a running program.
void NativeRobot::read_gains() {
    if (!robot_.eeprom_image) return;
    written().gains = Own<gain_tables_t>::make();
    auto &tables = *rare_->gains;
    auto word = [this](uint8_t entry, uint8_t upper) {
        const int value = eeprom(eeprom_gain_place(entry, upper)) << 8 |
                          eeprom(eeprom_gain_place(entry, static_cast<uint8_t>(upper + 1)));
        return static_cast<uint16_t>(std::min(value, CONVERTER_MOST));
    };
    for (uint8_t entry = 0; entry < GAIN_ENTRIES; entry++) {
        tables.low[entry] = word(entry, 0);
        tables.high[entry] = word(entry, 2);
    }
}

// A jump to address 0: memory as after power-up, main() again, the stack forgotten.
void NativeRobot::start_again() {
    std::memcpy(table().state_begin, program_->initial_state(), program_->state_bytes());
    robot_.life = RobotRecord::Life::OFF;
    robot_.core = {};
    acts_at_ = 0;
    state_since_ = robot_.now;
    switch_led_off();
    robot_.next_tick = NEVER;
    in_interrupt_ = interrupts_off_ = tick_pending_ = loop_due_ = false;
    came_back();
}

bool NativeRobot::restarts(const CodePath &code) {
    note(JUMPS_TO_ZERO,
         "it jumped to address 0, as by a call through a NULL pointer; as on the robot, it starts "
         "again with main() and waits for RUN",
         code);
    start_again();
    robot_.now += RESTART_CYCLES;
    return true;
}

}  // namespace kilotwin
