/// A native program of robots or modules: a loaded guest, and its state at power-up.
///
/// The state of all robots with the same program lives in images outside the guest; one of them at
/// a time is resident, swapped into the guest's one state section. A swap copies the state twice.
#ifndef KILOTWIN_ROBOTS_NATIVE_PROGRAM_H
#define KILOTWIN_ROBOTS_NATIVE_PROGRAM_H

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/clock.h"
#include "robots/native/abi.h"

namespace kilotwin {

class GuestStack;

/// Iterations of its loops that a program may take in a tick: one takes an AVR about ten cycles.
constexpr int32_t TURNS_PER_TICK = TICK_CYCLES / 10;

/// One per shared object, share of the robots (base/team.h) and process, however many simulations
/// use it: of each share the file is loaded once, so that its state section exists once. Not for
/// two threads at a time.
class Program {
  public:
    /// Loads the guest at `path` for a share, or finds it loaded already. It stays for the life of
    /// the process. Throws EngineError if the file cannot be loaded, is no guest, or was built for
    /// another ABI. To be called by one thread, while no guest runs.
    static Program &load(const std::string &path, const std::string &name, uint32_t share = 0);

    Program(const Program &) = delete;
    Program &operator=(const Program &) = delete;

    const std::string &name() const { return name_; }
    const std::string &path() const { return path_; }
    const kt_table_t &table() const { return *table_; }
    /// That its guests run on.
    GuestStack &stack() const { return stack_; }
    /// Whether the program has to do with kilo_tx_period itself.
    bool names_period() const { return names_period_; }
    /// Whether it cannot change that any more once its set-up is over.
    bool settles_period() const { return settles_period_; }
    /// Whether the program may ever have a message when it is requested for one: one that does not
    /// name kilo_message_tx has none.
    bool may_send() const { return may_send_; }
    /// Whether the program may read a sensor: not one that names no function or register for that.
    bool reads_sensors() const { return reads_sensors_; }
    /// Whether it notes which of its code has run: then it is not run tentatively.
    bool is_covered() const { return is_covered_; }
    /// Turns of loop() before it is looked at whether it busy-waits (busy_watch.h): fewer once it
    /// has done so. Changes the cost alone.
    int32_t turns_to_look = TURNS_PER_TICK;
    /// False: never fewer, the plain twin of early looks.
    bool looks_early = true;
    /// The part of the running robot's budget that it may take after the next look.
    int32_t turns_held_back = 0;
    /// Size of the state section, and of every image.
    size_t state_bytes() const { return state_bytes_; }

    /// The state at power-up, `state_bytes()` long.
    const uint8_t *initial_state() const { return initial_.data(); }

    /// Names of the interrupt handlers that the program defines, "A, B"; mostly empty. None of them
    /// is ever called: interrupts reach guests through the API alone.
    std::string own_handlers() const;

    /// Swaps the state kept at `image` into the guest, and the resident one back to its image. Free
    /// if `image` is resident already.
    void make_resident(uint8_t *image) {
        if (image != resident_) swap_in(image);
    }

    /// A copy of the state that belongs to `image`, resident or not.
    std::vector<uint8_t> state_of(const uint8_t *image) const;

    /// Sets the state that belongs to `image`, resident or not, from `state`, state_bytes() long;
    /// and copies it there.
    void set_state_of(uint8_t *image, const uint8_t *state);
    void copy_state_of(const uint8_t *image, uint8_t *state) const;

    /// Writes the state back if `image` is resident. To be called before it is freed or
    /// overwritten.
    void evict(const uint8_t *image);

    /// Whether an address lies within 2 KB of the state, the size of the robot's RAM, so that the
    /// robot has memory there. Likewise for an element before the first one by an unsigned index:
    /// on the robot the sum wraps as the index does.
    bool is_beside_state(const void *address) const;

    /// Whether an address lies in the guard pages around the state.
    bool guards(const void *address) const;

  private:
    Program(const std::string &path, std::string name, uint32_t share);
    void swap_in(uint8_t *image);
    const uint8_t *state_at(const uint8_t *image) const {
        return image == resident_ ? table_->state_begin : image;
    }

    std::string name_, path_;
    GuestStack &stack_;
    const kt_table_t *table_ = nullptr;
    bool names_period_ = false, settles_period_ = false, may_send_ = true, reads_sensors_ = true,
         is_covered_ = false;
    size_t state_bytes_ = 0;
    std::vector<uint8_t> initial_;
    uint8_t *resident_ = nullptr;
};

}  // namespace kilotwin

#endif
