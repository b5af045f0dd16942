/// A reset by a chip's watchdog, as it is reported. The program sees it by MCUSR, WDRF.
#ifndef KILOTWIN_AVR_WATCHDOG_RESET_H
#define KILOTWIN_AVR_WATCHDOG_RESET_H

#include <cstdint>
#include <string>

#include "base/clock.h"

namespace kilotwin {

struct WatchdogReset {
    uint32_t number;  ///< from 1, since power-up
    uint32_t pc;      ///< byte address of the instruction that would have been next
    uint8_t control;  ///< WDTCSR before it: the time that was set

    /// For people: what hung, and where.
    std::string text() const;

    /// A program may be reset again and again: the 1st, 2nd, 4th, 8th ... are reported.
    bool is_reported() const { return (number & (number - 1)) == 0; }
};

/// One that a board reports.
struct ReportedReset {
    Cycles at;
    WatchdogReset reset;
};

}  // namespace kilotwin

#endif
