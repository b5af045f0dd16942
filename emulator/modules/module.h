/// A Kilogrid module whose program is a guest: the emulator's driver of the module runtime.
///
/// The runtime itself is kilogrid_modules/runtime/core, the same C as on the chip: orders, bursts,
/// turns, records, answers. Here is what the chip's drivers do around it: a CAN controller with two
/// buffers, four cells with lights, one transmitter and one receiver, timer 0, the main loop, and
/// the calls of the module API.
///
/// As with a robot, the program takes no time and loop() is called once a tick. A module is run
/// ahead to a moment before which nothing from outside can reach it (lookahead); every output
/// carries its time, and the result equals that of running it tick by tick.
///
/// Not thread-safe: one module runs at a time in a thread, on that thread's guest stack.
#ifndef KILOTWIN_MODULES_MODULE_H
#define KILOTWIN_MODULES_MODULE_H

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "address.h"
#include "base/can_frame.h"
#include "base/chance.h"
#include "base/clock.h"
#include "base/events.h"
#include "robots/eeprom.h"
#include "robots/infrared_gains.h"
#include "robots/native/guest.h"
#include "runtime/core/bursts.h"
#include "runtime/core/orders.h"
#include "runtime/core/turns.h"

namespace kilotwin {

constexpr uint8_t CELLS_PER_MODULE = N_CELLS;

/// Shared by all modules of a grid. Outlives them.
struct ModuleContext {
    const Chance &chance;
    Events &events;            ///< their prints and failures; `robot` is the module's index
    bool gains_are_mm = true;  ///< receptions carry the distance itself, as both gains
};

/// A frame for the bus.
struct CanOutput {
    Cycles at;  ///< when the controller has it
    CanFrame frame;
};

/// Light of a cell: pulse widths of its red, green and blue LEDs.
struct CellLight {
    std::array<uint8_t, 3> rgb{};

    /// The API's colour: bit 0 red, bit 1 green, bit 2 blue.
    uint8_t color() const {
        return static_cast<uint8_t>((rgb[0] != 0) | (rgb[1] != 0) << 1 | (rgb[2] != 0) << 2);
    }
    /// The largest of the three widths.
    uint8_t brightness() const { return std::max({rgb[0], rgb[1], rgb[2]}); }
};

/// An infrared frame that a module is about to send.
struct CellEmission {
    Cycles at;     ///< begin of the frame
    uint8_t cell;  ///< 0 to 3
    message_t message;
};

/// One per module of a grid that runs as a guest. The grid executes it; times are the world's.
class Module final : public NativeGuest {
  public:
    /// States of the core (orders.h).
    enum class State : uint8_t {
        INIT = STATE_INIT,
        IDLE = STATE_IDLE,
        SETUP_KILOBOTS = STATE_SETUP_KILOBOTS,
        WAITING_FOR_PAGE = STATE_WAITING_FOR_PAGE,
        BOOTLOADING_KILOBOTS = STATE_BOOTLOADING_KILOBOTS,
        WAITING_FOR_CONFIGURATION = STATE_WAITING_FOR_CONFIGURATION,
        SETUP = STATE_SETUP,
        RUNNING = STATE_RUNNING,
        BOOT_LOADER = STATE_BOOT_LOADER,
    };

    /// Outcome of an attempt to send an infrared frame.
    enum class Answer : uint8_t {
        SENT,       ///< on air from outgoing().at on
        BUSY,       ///< carrier sense saw light: not sent, the attempt is over
        RECEIVING,  ///< the receiver is in the middle of a frame: not even tried
    };

    /// CAN frames lost or refused since the world began, over all resets.
    struct Counts {
        uint64_t frames_refused = 0;  ///< wrong length, out of range or order: they changed nothing
        uint64_t frames_missed = 0;   ///< came while the controller's two buffers were full
    };

    /// Module `index` at column `x`, row `y`, switched on at `power_up`; `tick` is the length of
    /// its tick by its own oscillator. `image`, program.state_bytes() bytes, holds its program's
    /// state and belongs to the caller. Throws EngineError if `program` is a robot's.
    Module(ModuleContext &context, Program &program, uint32_t index, uint8_t x, uint8_t y,
           Cycles tick, Cycles power_up, uint8_t *image);
    Module(Module &&) = default;  ///< for containers; it is never moved

    /// Runs everything strictly before `until`, but stops where the module is about to send by
    /// infrared. Returns the time run up to: `until`, or outgoing().at.
    Cycles run(Cycles until);

    /// The same where no robot is in range of its cells: frames that end before `until` go out
    /// without stopping. Returns how many.
    uint64_t run_unheard(Cycles until);

    /// Whether it waits for answer(); then outgoing() is what it would send, at the time run up to.
    /// Carrier sense is by the receiver, that is on listening_cell(), not on the cell that sends.
    bool asks() const { return asking_ != Asking::NOTHING; }
    const CellEmission &outgoing() const { return outgoing_; }

    /// Outcome of outgoing(); only while asks(). SENT keeps the module busy, and deaf, for
    /// FRAME_CYCLES. The next run goes on from there. A cell that found the channel busy waits for
    /// its next turn.
    void answer(Answer answer);

    /// The earliest moment at which the module may stop at a frame by infrared, or put one on the
    /// bus, if nothing reaches it before; NEVER if none. It need not be run before then: nothing
    /// else it does has an effect outside (its lights are right only as far as it was run).
    Cycles next_event() const;

    /// Takes a CAN frame that passed filters(), complete at `at`, not earlier than the time run up
    /// to.
    void receive_can(Cycles at, const CanFrame &frame);

    /// Identifiers that its controller takes: broadcast, its row, its column, its own.
    std::array<uint16_t, KILOGRID_FILTERS> filters() const;

    /// Takes an infrared frame that ended at `at` on the cell listened to, with a right checksum or
    /// not.
    void receive_ir(Cycles at, uint8_t cell, const message_t &message,
                    distance_measurement_t distance, bool crc_error);

    /// A frame is coming in at the cell listened to from `begin` to `end`: the receiver stays
    /// there. In order of time.
    void hold_receiver(Cycles begin, Cycles end);

    /// The cell that the receiver listens to at `at`, a dwell of 10.24 ms each. Times must not go
    /// back.
    uint8_t listening_cell(Cycles at);

    /// Power cycle at `at`, not earlier than the time run up to: starts from main() again. The
    /// EEPROM stays.
    void reset(Cycles at);

    // Identity and state, for reading at any time.
    uint32_t index() const { return index_; }  ///< in the grid
    uint8_t x() const { return x_; }           ///< column
    uint8_t y() const { return y_; }           ///< row
    Cycles now() const { return time_.now; }   ///< the time run up to
    State state() const { return static_cast<State>(orders_.state); }
    const char *state_name() const;                          ///< as the run folder has it
    bool stopped() const { return life_ == Life::STOPPED; }  ///< its program failed
    const Counts &counts() const { return counts_; }
    uint32_t ticks() const { return last_tick_; }  ///< module_ticks at its last tick

    /// Light of `cell` at `at`, up to which the module has been run.
    CellLight light(uint8_t cell, Cycles at) const;

    /// A byte of its EEPROM of EEPROM_BYTES; addresses wrap. What is written counts from the next
    /// use on.
    uint8_t eeprom(uint16_t address) const override;
    void set_eeprom(uint16_t address, uint8_t value) override;

    /// Error counters of its CAN controller, for health reports.
    void set_can_errors(uint8_t tec, uint8_t rec) {
        tec_ = tec;
        rec_ = rec;
    }

    /// Frames for the bus, in order of time; the caller clears them.
    std::vector<CanOutput> can_frames;

  private:
    /// STOPPED: its program crashed or never came back; only reset() ends that.
    enum class Life : uint8_t { OFF, BOOTING, ALIVE, STOPPED };
    enum class Asking : uint8_t { NOTHING, TURN, AT_ONCE };  ///< why it is about to send

    /// Inputs that wait for their time; their interrupts come then.
    struct CanReception {
        Cycles at;
        CanFrame frame;
    };
    struct CellReception {
        Cycles at;
        message_t message;
        distance_measurement_t distance;
        uint8_t cell;
        bool crc_error;
    };

    /// A callback of the program runs as an interrupt while this exists: interrupts off, a budget
    /// of its own.
    class Interrupt {
      public:
        explicit Interrupt(Module &module);
        ~Interrupt();
        Interrupt(const Interrupt &) = delete;
        Interrupt &operator=(const Interrupt &) = delete;

      private:
        Module &module_;
        int32_t budget_;
        bool nested_;
    };

    /// Functions that the guest calls.
    static const kt_module_host_t MODULE_CALLS;
    static const kt_host_t &calls();
    struct ModuleCalls;

    // module.cpp: power, running ahead, jobs of the main loop, lights, EEPROM.
    void go_on(Cycles until);  ///< executes up to there, or to a question
    void live() override;      ///< main(), then the main loop
    /// Whether it provably has no observable effect before `until`.
    bool has_nothing_before(Cycles until) const;
    /// Whether what is answered leaves nothing to do that cannot wait.
    bool may_be_left_behind() const;
    Cycles next_turn() const;  ///< when a cell that repeats a message may send
    Cycles next_pass() const;  ///< when the main loop has something to do
    void pass();               ///< one pass of the main loop
    void do_job(job_t job);    ///< what the core's orders have left to it
    void set_up();
    void run_loop();
    /// Goes on to the next tick if that comes before `quiet_until` and does nothing but count.
    bool pass_tick(const kt_table_t &table, Cycles quiet_until);
    /// The next frame of a burst; false at its end.
    bool send_burst_frame();
    void end_burst();
    void follow_state(uint8_t before);     ///< notes a change of state
    CellLight breathing(Cycles at) const;  ///< of the idle module
    /// Calls into the program with its state in place.
    template <typename Call> void run_program(Call call);
    void switch_off();
    void stop(EventKind kind, std::string text, CodePath code = {}) override;
    void report(EventKind kind, std::string text, CodePath code = {}) override;
    uint8_t &noted() override { return noted_; }
    bool is_stopped() const override { return life_ == Life::STOPPED; }
    void abandoned() override { in_program_ = in_interrupt_ = false; }

    // modules/interrupts.cpp: timer, transmitter, receiver.
    Cycles next_interrupt() const;    ///< the earliest of tick, CAN, infrared
    void serve_interrupt(Cycles at);  ///< the one that is due then
    void tick() override;             ///< compare match of timer 0
    void take_turn();                 ///< the next cell sends, if it repeats a message
    void ask(Asking why, uint8_t cell, const message_t &message);
    void settle();                 ///< acts on the answer
    void keep_busy(Cycles until);  ///< interrupts are off, a frame is on air
    void take_cell_message();      ///< calls the program with a reception

    /// Whether its runtime has the traits of runtime/core/traits.h.
    bool is_original() const { return program_->table().original != 0; }

    // modules/can.cpp: orders, answers.
    void take_can();  ///< the controller's interrupt
    /// Orders that the core leaves to the driver.
    void carry_out(order_t order, const CanFrame &frame);
    void configure();  ///< copies the configuration into the program's
    void forward();    ///< an infrared message of the host to the cells
    void enter_boot_loader();
    void take_in_boot_loader(const CanFrame &frame);
    [[noreturn]] void restart();
    void hand_over(const CanFrame &frame);
    void forward_reports();  ///< of robots, to the host
    void answer_poll();
    void answer_health(uint8_t part);
    void queue_answer(const CanFrame &frame, Cycles gap);  ///< `gap` after the one before
    void emit_answers(Cycles until);                       ///< those that are due
    void miss_frame();                                     ///< counts it
    CanFrame frame_to_host() const;
    static CanFrame frame_of(const kt_can_message_t &message, uint16_t id);
    uint16_t configuration_crc() const;

    // modules/calls.cpp: the API.
    void init() override;
    void start() override { life_ = Life::ALIVE; }
    void wait_until(Cycles wake) override;
    uint64_t random_bits() override;
    uint8_t distance_mm(distance_measurement_t measured) const override;
    void print(const char *text, uint32_t bytes, uint8_t line) override;

    ModuleContext &context_;
    std::vector<CanReception> can_inbox_;  ///< in order of time, as cell_inbox_
    std::vector<CellReception> cell_inbox_;
    std::vector<CanOutput> answers_;       ///< in order of time, not yet handed out
    std::unique_ptr<EepromImage> eeprom_;  ///< once the program has written to it
    InfraredGains gains_;

    // Time.
    GuestTime own_time_;        ///< time_
    Cycles unheard_until_ = 0;  ///< frames that end before need no answer
    Cycles power_up_;           ///< also of the last reset
    Cycles busy_until_ = 0;     ///< interrupts are off: the CAN controller keeps two frames
    Cycles wake_ = NEVER;       ///< when the suspended program goes on
    Cycles state_since_ = 0;    ///< for its lights
    Cycles repeat_at_ = 0;      ///< the next round of a forwarded message
    Cycles burst_at_ = 0;       ///< the next frame of a burst that is on its way
    Cycles dwell_end_;          ///< when the receiver goes to the next cell
    Cycles held_from_ = 0, held_until_ = 0;  ///< a frame holds the receiver
    // Program and outputs.
    uint64_t rand_hard_draws_ = 0;  ///< so far
    uint64_t unheard_ = 0;          ///< frames sent within run_unheard()
    uint32_t index_;
    uint32_t last_tick_ = 0;
    std::array<message_t, CELLS_PER_MODULE> cell_messages_{};  ///< that they repeat
    std::array<CellLight, CELLS_PER_MODULE> lights_{};         ///< as the program set them
    CellEmission outgoing_{};                                  ///< what it asks about
    Counts counts_;
    CanFrame broadcast_;  ///< of the program, if pending
    turns_t turns_{};     ///< which cell sends next, and when
    uint8_t x_, y_;
    uint8_t sending_cells_ = 0;  ///< bit per cell that repeats a message
    uint8_t dwell_cell_ = 0;     ///< the receiver's
    uint8_t buffered_ = 0;       ///< CAN frames that came since it is busy
    uint8_t tec_ = 0, rec_ = 0;  ///< error counters of its node
    uint8_t noted_ = 0;          ///< mistakes (fault.h) that were reported
    Life life_ = Life::OFF;
    Asking asking_ = Asking::NOTHING;
    Asking answered_ = Asking::NOTHING;  ///< the question to answer_, until settle() acts on it
    Answer answer_ = Answer::SENT;
    bool broadcast_pending_ = false;
    bool in_program_ = false;  ///< on the guest stack, in code of the program
    orders_t orders_;          ///< state, transfers, what the main loop has to do
    burst_t burst_{};          ///< the one on its way, if its job is not JOB_NONE
};

}  // namespace kilotwin

#endif
