/// The mock of the Kilobot API: one robot's clock, callbacks and registers around its program.
///
/// Time is the hardware's (hardware.md 1.2, 1.6): a tick each 32.768 ms, transmission asked for from the tick's
/// interrupt, callbacks where an interrupt would come, `delay()` that lets time pass. The program itself takes no
/// time. A robot is run ahead up to a moment before which nothing from outside can reach it; what it does is a list
/// of commands with their times, the same however far it is run at once.
#ifndef KILOTWIN_GUEST_ROBOT_H
#define KILOTWIN_GUEST_ROBOT_H

#include <cstdint>
#include <memory>
#include <vector>

#include "engine/chance.h"
#include "engine/clock.h"
#include "engine/events.h"
#include "guest/program.h"
#include "guest/stack.h"

namespace kilotwin {

/// A message on its way into a robot.
struct Reception {
    Cycles at;  ///< end of the frame
    message_t message;
    distance_measurement_t distance;
};

struct MotorCommand {
    Cycles at;
    uint8_t left, right;
};

struct Emission {
    Cycles at;  ///< begin of the frame
    uint32_t robot;
    message_t message;
};

/// Calibration that kilo_init reads from EEPROM.
struct Calibration {
    uint16_t uid;
    uint8_t turn_left, turn_right, straight_left, straight_right;
};

/// Last words: which robot runs. Survives the process when it is a mapped file.
struct BlackBox {
    uint32_t robot;  ///< index
    uint32_t tick;   ///< its kilo_ticks at the last tick
};

/// What all robots of a world share.
struct RobotContext {
    const Chance &chance;
    Events &events;
    std::vector<Emission> &emissions;  ///< appended in the order of each robot's time
    BlackBox *black_box = nullptr;     ///< may be null
};

class Robot {
  public:
    /// Robot `index`, switched on at `power_up`. `image` holds its state: program->state_bytes() bytes of its own.
    Robot(RobotContext &context, std::shared_ptr<Program> program, uint32_t index, Calibration calibration,
          Cycles power_up, uint8_t *image);
    ~Robot();
    Robot(const Robot &) = delete;
    Robot &operator=(const Robot &) = delete;

    /// To be called by a thread before it runs robots.
    static void serve_this_thread();

    /// Lets the robot live through everything strictly before `until`.
    void run(Cycles until);

    /// A message whose frame ends at `reception.at`, not earlier than the time run up to. Any order.
    void receive(const Reception &reception);

    uint32_t index() const { return index_; }
    uint16_t uid() const { return calibration_.uid; }
    uint8_t color() const { return color_; }          ///< RGB() value shown at the time run up to
    bool stopped() const { return life_ == Life::STOPPED; }
    const Program &program() const { return *program_; }

    /// Motor commands of the last run(), in order of time; the caller clears them.
    std::vector<MotorCommand> motor_commands;

  private:
    enum class Life : uint8_t { OFF, BOOTING, ALIVE, STOPPED };
    enum class State : uint8_t { IDLE, SETUP, RUNNING, SLEEPING };  ///< hardware.md 1.3

    static const kt_host_t HOST;
    struct HostCalls;

    static void body(void *robot);
    void live();
    void serve_interrupt();
    void tick();
    void ask_for_message();
    void take_message();
    void obey(const message_t &message);
    [[noreturn]] void reset();
    void switch_motors_off();
    template <typename Callback> void interrupt(Callback callback);
    void wait_until(Cycles wake);
    void budget_spent(const uint8_t *frame);
    uint64_t memory_fingerprint(const uint8_t *frame) const;
    void came_back();
    Cycles next_interrupt() const;
    void stop(EventKind kind, std::string text);
    void set_outputs();
    void report(EventKind kind, std::string text);

    RobotContext &context_;
    std::shared_ptr<Program> program_;
    uint8_t *image_;
    SuspendedCall suspended_;
    std::vector<Reception> inbox_;  ///< in order of time, from inbox_next_ on
    size_t inbox_next_ = 0;

    Cycles now_;
    Cycles until_ = 0;
    Cycles next_tick_;
    void (*setup_)(void) = nullptr;
    void (*loop_)(void) = nullptr;
    uint64_t rand_hard_draws_ = 0;
    uint64_t fingerprint_ = 0;         ///< of the memory when the budget was last spent
    Cycles busy_since_ = NEVER;        ///< since when the program has not come back
    Cycles computing_since_ = NEVER;   ///< since when it changed memory at every tick of that
    uint32_t index_;
    Calibration calibration_;
    uint32_t last_tick_ = 0;  ///< kilo_ticks after the last tick, for reports: the program may spoil its own
    uint16_t tx_clock_ = 0;
    uint8_t left_ = 0, right_ = 0;     ///< as set_motors wrote them
    uint8_t color_ = 0;
    Life life_ = Life::OFF;
    State state_ = State::IDLE;
    bool motors_on_ = false;
    bool in_interrupt_ = false;
    bool loop_due_ = false;
    bool set_up_ = false;
    bool warned_ = false;
};

}  // namespace kilotwin

#endif
