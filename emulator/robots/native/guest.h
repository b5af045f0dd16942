/// A native guest: the program of a robot or of a module, compiled for this computer, and what its
/// calls of the API do (kt_host_t, abi.h). What differs between a robot and a module is virtual.
///
/// One guest of a share runs at a time (base/team.h), on that share's stack, in whichever thread.
#ifndef KILOTWIN_ROBOTS_NATIVE_GUEST_H
#define KILOTWIN_ROBOTS_NATIVE_GUEST_H

#include <cstdint>
#include <string>

#include "base/clock.h"
#include "base/events.h"
#include "robots/native/busy_watch.h"
#include "robots/native/program.h"
#include "robots/native/stack.h"
#include "robots/timer.h"

namespace kilotwin {

/// State of a guest besides its variables, which can be copied.
struct GuestState {
    BusyWatch busy_;
    SuspendedCall suspended_;  ///< the program in a delay(), or between runs
    void (*setup_)(void) = nullptr;
    void (*loop_)(void) = nullptr;
    bool is_suspended_ : 1 = false;    ///< a call waits in suspended_, which only then is looked at
    bool in_interrupt_ : 1 = false;    ///< in a callback of the program
    bool interrupts_off_ : 1 = false;  ///< by cli()
    bool tick_pending_ : 1 = false;    ///< a tick came while interrupts were off
    bool loop_due_ : 1 = false;        ///< a tick has passed since loop() came back
};

class NativeGuest : protected GuestState {
  public:
    /// Prepares the calling thread; once, before it runs guests.
    static void serve_this_thread() { GuestStack::serve_this_thread(); }

    virtual ~NativeGuest();
    NativeGuest(NativeGuest &&) = default;
    NativeGuest(const NativeGuest &) = delete;
    NativeGuest &operator=(const NativeGuest &) = delete;

  protected:
    /// `image`, program.state_bytes() long, holds the program's state, which is set to that at
    /// power-up. All must live on. A module has `calls` of its own, made by calls_with().
    NativeGuest(Program &program, GuestTime &time, uint8_t *image, const kt_host_t &calls = CALLS);
    static kt_host_t calls_with(const kt_module_host_t &of_a_module);

    /// The guest that the program's calls act on.
    static NativeGuest &running() { return *running_; }

    const kt_table_t &table() const { return program_->table(); }
    GuestStack &stack() const { return program_->stack(); }

    /// Executes the guest up to time_.until, or to where it waits for an answer of the channel.
    void execute();
    /// Leaves the program as it is; other guests run meanwhile, by the same budget.
    void suspend();
    /// Forgets the call that is suspended.
    void drop_call() {
        suspended_.clear();
        is_suspended_ = false;
    }
    void came_back() { busy_.came_back(*program_, *table().budget); }

    // Acts that a robot and a module do in their own ways.

    virtual void live() = 0;                   ///< on the guest stack: main(), then the main loop
    virtual void init() = 0;                   ///< kilo_init(), module_init()
    virtual void start() = 0;                  ///< kilo_start(), module_start(): it is alive now
    virtual void wait_until(Cycles wake) = 0;  ///< serves interrupts meanwhile
    virtual void tick() = 0;                   ///< compare match of timer 0
    virtual void interrupts_changed() {}       ///< by cli() or sei()
    virtual void outputs_changed() {}          ///< the registers of motors and LED, maybe
    virtual uint64_t random_bits() = 0;        ///< of rand_hard()
    virtual int16_t sensor(uint8_t /*channel*/) { return 0; }  ///< of the converter
    virtual uint8_t distance_mm(distance_measurement_t measured) const = 0;
    virtual uint8_t eeprom(uint16_t address) const = 0;
    virtual void set_eeprom(uint16_t address, uint8_t value) = 0;
    virtual void print(const char *text, uint32_t bytes, uint8_t line) = 0;  ///< KT_LINE_...
    virtual void serial_written() {}  ///< a byte, by the register
    virtual void serial_ready() {}    ///< waits until that takes one
    virtual bool is_stopped() const = 0;
    virtual void abandoned() {}  ///< its call ended for good
    /// Whether it starts again where it jumped to address 0.
    virtual bool restarts(const CodePath & /*code*/) { return false; }
    virtual void stop(EventKind kind, std::string text, CodePath code) = 0;
    virtual void report(EventKind kind, std::string text, CodePath code = {}) = 0;
    virtual uint8_t &noted() = 0;  ///< Mistakes (fault.h) that were reported
    void note(uint8_t mistake, std::string text, CodePath code = {});  ///< once each

    Program *program_;  ///< shared by all guests that run it
    GuestTime &time_;
    uint8_t *image_;  ///< its state while another guest's is in place

  private:
    struct Calls;
    static const kt_host_t CALLS;
    static void body(void *guest) { static_cast<NativeGuest *>(guest)->live(); }
    void budget_spent(const uint8_t *frame);

    /// The guest that this thread runs; null between runs. A call that is suspended may go on in
    /// another thread, so that what is called looks at it once, at its begin.
    inline static thread_local NativeGuest *running_ __attribute__((tls_model("initial-exec"))) =
        nullptr;
};

}  // namespace kilotwin

#endif
