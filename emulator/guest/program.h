/// A robot program as the engine sees it: a loaded guest, and the bytes of its state at power-up.
#ifndef KILOTWIN_GUEST_PROGRAM_H
#define KILOTWIN_GUEST_PROGRAM_H

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "guest/abi.h"

namespace kilotwin {

/// One per shared object and process, however many worlds use it: its state section exists only
/// once.
class Program {
  public:
    /// Loads the guest at `path` (or finds it loaded already). Throws EngineError when it is no
    /// guest of this build. It stays for the life of the process.
    static Program &load(const std::string &path, const std::string &name);

    Program(const Program &) = delete;
    Program &operator=(const Program &) = delete;

    const std::string &name() const { return name_; }
    const std::string &path() const { return path_; }
    const kt_table_t &table() const { return *table_; }
    size_t state_bytes() const { return state_bytes_; }

    /// The state at power-up, `state_bytes()` long.
    const uint8_t *initial_state() const { return initial_.data(); }

    /// Names of the interrupt handlers that the program defines for itself, "A, B": none is ever
    /// called here. Mostly empty.
    std::string own_handlers() const;

    /// Puts the state kept at `image` into the guest; what was there goes back to where it came
    /// from. Pass the same pointer again and nothing is copied.
    void make_resident(uint8_t *image) {
        if (image != resident_) swap_in(image);
    }

    /// The state of the robot whose image this is, wherever it is at present.
    std::vector<uint8_t> state_of(const uint8_t *image) const;

    /// To be called before `image` is given up or overwritten from outside.
    void evict(const uint8_t *image);

    /// Whether an address lies so near to the state that the robot, whose RAM has 2 KB, has memory
    /// there. Also that of an element before the first one, by an index without sign: on the robot
    /// the sum wraps as the index does.
    bool is_beside_state(const void *address) const;

    /// Whether an address lies in the guard pages around the state.
    bool guards(const void *address) const;

  private:
    Program(const std::string &path, std::string name);
    void swap_in(uint8_t *image);

    std::string name_, path_;
    const kt_table_t *table_ = nullptr;
    size_t state_bytes_ = 0;
    std::vector<uint8_t> initial_;
    uint8_t *resident_ = nullptr;
};

}  // namespace kilotwin

#endif
