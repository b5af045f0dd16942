/// A value change dump: what signals did when, for a wave viewer (IEEE 1364, chapter 18).
#ifndef KILOTWIN_AVR_CHIP_VCD_TRACE_H
#define KILOTWIN_AVR_CHIP_VCD_TRACE_H

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "base/clock.h"

namespace kilotwin {

class VcdTrace {
  public:
    struct Signal {
        std::string name;
        uint8_t bits;  ///< 1 to 8
    };

    /// Begins the file at `path`; `scope` is how a viewer names the group. Throws EngineError when it cannot be
    /// written.
    VcdTrace(const std::string &path, const std::string &scope, std::vector<Signal> signals);

    /// A signal's value from `at` on; `at` never decreases. What does not change is not written.
    void set(Cycles at, size_t signal, uint8_t value);

  private:
    std::ofstream file_;
    std::vector<Signal> signals_;
    std::vector<int> values_;  ///< -1: none yet
    Cycles at_ = NEVER;        ///< of the last time mark
};

}  // namespace kilotwin

#endif
