/// A value change dump (VCD): signals over time, for a wave viewer (IEEE 1364, chapter 18). Time
/// unit of the file: 1 ns.
#ifndef KILOTWIN_AVR_CHIP_VCD_TRACE_H
#define KILOTWIN_AVR_CHIP_VCD_TRACE_H

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "base/clock.h"

namespace kilotwin {

/// Writes through a buffered stream: the file is complete once the trace is destroyed.
class VcdTrace {
  public:
    /// At most 94 signals: each has one printable character as its code.
    struct Signal {
        std::string name;  ///< without blanks
        uint8_t bits;      ///< 1 to 8
    };

    /// Begins the file at `path`; `scope` is the viewer's name of the group. Throws EngineError if
    /// it cannot be written.
    VcdTrace(const std::string &path, const std::string &scope, std::vector<Signal> signals);

    /// Sets a signal, an index into `signals`, from `at` on; `at` never decreases. Unchanged values
    /// are not written.
    void set(Cycles at, size_t signal, uint8_t value);

  private:
    std::ofstream file_;
    std::vector<Signal> signals_;
    std::vector<int> values_;  ///< last written, by signal; -1: none yet
    Cycles at_ = NEVER;        ///< of the last time mark
};

}  // namespace kilotwin

#endif
