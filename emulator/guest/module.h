/// The mock of the Kilogrid module API: one module's runtime around its program, which is a guest
/// like a robot's.
///
/// A module has four cells, each with lights, a transmitter and a receiver, and one CAN controller.
/// What its runtime does is hardware.md 3.2 to 3.4 and 3.7: states and their lights, infrared
/// commands repeated for robots, each cell's message once in 16 ticks, configuration, tracking
/// records kept for the next poll. As with a robot, the program takes no time, loop() is called
/// once a tick, and a module is run ahead up to a moment before which nothing from outside can
/// reach it.
#ifndef KILOTWIN_GUEST_MODULE_H
#define KILOTWIN_GUEST_MODULE_H

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
#include "guest/busy_watch.h"
#include "guest/eeprom.h"
#include "guest/infrared_gains.h"
#include "guest/program.h"
#include "guest/stack.h"
#include "transfer.h"

namespace kilotwin {

constexpr uint8_t CELLS_PER_MODULE = 4;

/// What all modules of a grid share.
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

/// The LEDs of a cell: pulse widths of red, green and blue.
struct CellLight {
    std::array<uint8_t, 3> rgb{};

    /// The API's colour: bit 0 red, bit 1 green, bit 2 blue.
    uint8_t color() const {
        return static_cast<uint8_t>((rgb[0] != 0) | (rgb[1] != 0) << 1 | (rgb[2] != 0) << 2);
    }
    /// Of the brightest part.
    uint8_t brightness() const { return std::max({rgb[0], rgb[1], rgb[2]}); }
};

/// A frame that a module is about to send by infrared.
struct CellEmission {
    Cycles at;  ///< begin of the frame
    uint8_t cell;
    message_t message;
};

class Module {
  public:
    enum class State : uint8_t {
        INIT,
        IDLE,
        SETUP_KILOBOTS,
        WAITING_FOR_PAGE,
        BOOTLOADING_KILOBOTS,
        WAITING_FOR_CONFIGURATION,
        SETUP,
        RUNNING,
        BOOT_LOADER,  ///< the module's own
    };

    /// What becomes of a frame that the module is about to send.
    enum class Answer : uint8_t {
        SENT,       ///< it is on air from the time asked about on
        BUSY,       ///< light was seen: not sent, the attempt is over
        RECEIVING,  ///< the receiver is in the middle of a frame: it was not even tried
    };

    /// What was lost or refused, since the world began.
    struct Counts {
        uint64_t frames_refused = 0;  ///< wrong length, out of range or order: they changed nothing
        uint64_t frames_missed = 0;   ///< came while the controller's two buffers were full
    };

    /// Module `index` at column `x`, row `y`, switched on at `power_up`; `tick` by its own
    /// oscillator. `image` holds its program's state: program.state_bytes() bytes of its own.
    /// Throws EngineError if `program` is not a module's.
    Module(ModuleContext &context, Program &program, uint32_t index, uint8_t x, uint8_t y,
           Cycles tick, Cycles power_up, uint8_t *image);
    ~Module();
    Module(Module &&) = default;
    Module(const Module &) = delete;
    Module &operator=(const Module &) = delete;

    /// To be called by a thread before it runs modules.
    static void serve_this_thread();

    /// Lives through everything strictly before `until`, but stops where it is about to send by
    /// infrared. Returns the time run up to: `until`, or that of the question.
    Cycles run(Cycles until);

    /// The same where nobody can hear it, nor be heard: frames that are over before `until` go out
    /// without a question. Returns how many.
    uint64_t run_unheard(Cycles until);

    /// Whether it waits for answer(); then outgoing() is what it would send, at the time run up to.
    /// Carrier sense is by the receiver, that is on listening_cell(), not on the cell that sends.
    bool asks() const { return asking_ != Asking::NOTHING; }
    const CellEmission &outgoing() const { return outgoing_; }

    /// SENT keeps it deaf and busy for FRAME_CYCLES. The next run goes on from there. A cell that
    /// found the channel busy waits for its next turn.
    void answer(Answer answer);

    /// The earliest moment at which it may ask, or put a frame on the bus, if nothing reaches it
    /// before; NEVER if none. It may be left behind till then: what else it does is seen by nobody
    /// (its lights are right only as far as it was run).
    Cycles next_event() const;

    /// A frame that passed filters(), complete at `at`, not earlier than the time run up to.
    void receive_can(Cycles at, const CanFrame &frame);

    /// Identifiers that its controller takes: broadcast, its row, its column, its own.
    std::array<uint16_t, KILOGRID_FILTERS> filters() const;

    /// An infrared frame that ended at `at` on the cell listened to, with a right checksum or not.
    void receive_ir(Cycles at, uint8_t cell, const message_t &message,
                    distance_measurement_t distance, bool crc_error);

    /// A frame is coming in at the cell listened to from `begin` to `end`: the receiver stays with
    /// it. In order of time.
    void hold_receiver(Cycles begin, Cycles end);

    /// The cell that the receiver listens to at `at`: 10.24 ms each. Times must not go back.
    uint8_t listening_cell(Cycles at);

    /// A power cycle at `at`, not earlier than the time run up to: starts from main() again. The
    /// EEPROM stays.
    void reset(Cycles at);

    uint32_t index() const { return index_; }
    uint8_t x() const { return x_; }
    uint8_t y() const { return y_; }
    Cycles now() const { return now_; }
    State state() const { return state_; }
    const char *state_name() const;
    bool stopped() const { return life_ == Life::STOPPED; }  ///< its program failed
    const Counts &counts() const { return counts_; }
    uint32_t ticks() const { return last_tick_; }  ///< module_ticks at its last tick

    /// What the LEDs of `cell` show at `at`, which it has been run up to.
    CellLight light(uint8_t cell, Cycles at) const;

    /// Its EEPROM, EEPROM_BYTES; addresses go round. What is written counts from the next use on.
    uint8_t eeprom(uint16_t address) const;
    void set_eeprom(uint16_t address, uint8_t value);

    /// Its controller's error counters, for health reports.
    void set_can_errors(uint8_t tec, uint8_t rec) {
        tec_ = tec;
        rec_ = rec;
    }

    /// Frames for the bus, in order of time; the caller clears them.
    std::vector<CanOutput> can_frames;

  private:
    enum class Life : uint8_t { OFF, BOOTING, ALIVE, STOPPED };
    enum class Asking : uint8_t { NOTHING, TURN, AT_ONCE };        ///< why it is about to send
    enum class Burst : uint8_t { NONE, REPETITION, START, PAGE };  ///< what frames in a row are for

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
    struct CellMessage {
        uint8_t cell;
        message_t message;
    };

    static const kt_module_host_t MODULE_HOST;
    static const kt_host_t HOST;
    struct HostCalls;

    static void body(void *module);
    void go_on(Cycles until);
    void live();
    bool has_nothing_before(Cycles until) const;
    Cycles next_interrupt() const;
    bool may_be_left_behind() const;
    Cycles next_turn() const;
    Cycles next_pass() const;
    void pass();
    void pass_of_state();
    void run_loop();
    bool pass_tick(const kt_table_t &table, Cycles quiet_until);
    void start_running();
    void send_burst_frame();
    void end_burst();
    void begin_repetition();
    void begin_page();
    void end_page();
    void serve_interrupt(Cycles at);
    void tick();
    void take_turn();
    void ask(Asking why, uint8_t cell, const message_t &message);
    void settle();
    void keep_busy(Cycles until);
    void take_can();
    void take_cell_message();
    void obey(const CanFrame &frame);
    void transferred(transfer_event_t event);
    void forward_message();
    bool obey_as_boot_loader(const CanFrame &frame);
    void hand_over(const CanFrame &frame);
    void enter(State state);
    void answer_poll();
    void answer_health();
    void queue_answer(const CanFrame &frame, Cycles gap);
    void emit_answers(Cycles until);
    template <typename Call> void run_program(Call call);
    template <typename Callback> void interrupt(Callback callback);
    void wait_until(Cycles wake);
    void switch_off();
    [[noreturn]] void restart();
    void came_back() { busy_.came_back(*program_->table().budget); }
    void budget_spent(const uint8_t *frame);
    CanFrame frame_to_host(uint8_t type) const;
    void light_all(uint8_t color, uint8_t brightness);
    uint16_t configuration_crc() const;
    void stop(EventKind kind, std::string text);
    void report(EventKind kind, std::string text);

    ModuleContext &context_;
    Program *program_;
    uint8_t *image_;
    SuspendedCall suspended_;
    std::vector<CanReception> can_inbox_;  ///< in order of time, as cell_inbox_
    std::vector<CellReception> cell_inbox_;
    std::vector<CanOutput> answers_;  ///< in order of time, not yet handed out
    std::vector<CellMessage> burst_;
    std::unique_ptr<EepromImage> eeprom_;  ///< once the program has written to it
    InfraredGains gains_;
    transfer_t transfer_;
    BusyWatch busy_;

    Cycles now_;
    Cycles until_ = 0;
    Cycles unheard_until_ = 0;  ///< what it sends before that nobody hears
    Cycles tick_;
    Cycles next_tick_ = NEVER;  ///< compare match of timer 0
    Cycles power_up_;
    Cycles busy_until_ = 0;  ///< interrupts are off: the CAN controller keeps two frames
    Cycles wake_ = NEVER;    ///< when the suspended program goes on
    Cycles state_since_ = 0;
    Cycles repeat_at_ = 0;  ///< the next round of a forwarded message
    Cycles mux_next_;       ///< when the receiver goes to the next cell
    Cycles held_from_ = 0, held_until_ = 0;
    void (*setup_)(void) = nullptr;
    void (*loop_)(void) = nullptr;
    uint64_t rand_hard_draws_ = 0;
    uint64_t unheard_ = 0;
    size_t burst_next_ = 0;
    uint32_t index_;
    uint32_t last_tick_ = 0;
    std::array<message_t, CELLS_PER_MODULE> cell_messages_{};
    std::array<CellLight, CELLS_PER_MODULE> lights_{};
    CellEmission outgoing_{};
    Counts counts_;
    CanFrame broadcast_;
    uint16_t tx_clock_ = 0;
    uint16_t tick_increment_ = 0;  ///< counts of the timer that the next compare match stands for
    uint8_t x_, y_;
    uint8_t sending_cells_ = 0;  ///< bit per cell that repeats a message
    uint8_t turn_cell_ = 0;      ///< the last one whose turn it was
    uint8_t mux_cell_ = 0;
    uint8_t buffered_ = 0;  ///< CAN frames that came since it is busy
    uint8_t page_cell_ = 0;
    uint8_t pages_received_ = 0;
    uint8_t health_asked_ = 0;  ///< bit per part
    uint8_t tec_ = 0, rec_ = 0;
    uint8_t noted_ = 0;  ///< Mistakes
    Life life_ = Life::OFF;
    State state_ = State::INIT;
    Asking asking_ = Asking::NOTHING;
    Asking answered_ = Asking::NOTHING;  ///< what answer_ is to; to be acted upon
    Answer answer_ = Answer::SENT;
    Burst burst_kind_ = Burst::NONE;
    bool autostart_ = false;
    bool set_up_ = false;   ///< setup() has run since the last configuration
    bool started_ = false;  ///< RUN has been sent to the robots
    bool poll_pending_ = false;
    bool page_pending_ = false;
    bool broadcast_pending_ = false;
    bool loop_due_ = false;
    bool in_program_ = false;
    bool in_interrupt_ = false;
    bool interrupts_off_ = false;
    bool tick_pending_ = false;
};

}  // namespace kilotwin

#endif
