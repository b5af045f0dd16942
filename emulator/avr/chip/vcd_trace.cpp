#include "avr/chip/vcd_trace.h"

#include <utility>

#include "base/errors.h"

namespace kilotwin {

namespace {

constexpr Cycles NANOSECONDS = 125;  // of a cycle

char code_of(size_t signal) { return static_cast<char>('!' + signal); }

}  // namespace

VcdTrace::VcdTrace(const std::string &path, const std::string &scope, std::vector<Signal> signals)
    : file_(path),
      signals_(std::move(signals)),
      values_(signals_.size(), -1) {
    if (!file_) throw EngineError("the trace " + path + " cannot be written");
    file_ << "$timescale 1ns $end\n$scope module " << scope << " $end\n";
    for (size_t i = 0; i < signals_.size(); i++)
        file_ << "$var wire " << int(signals_[i].bits) << ' ' << code_of(i) << ' '
              << signals_[i].name << " $end\n";
    file_ << "$upscope $end\n$enddefinitions $end\n";
}

void VcdTrace::set(Cycles at, size_t signal, uint8_t value) {
    if (values_[signal] == value) return;
    values_[signal] = value;
    if (at != at_) file_ << '#' << at * NANOSECONDS << '\n';
    at_ = at;
    const uint8_t bits = signals_[signal].bits;
    if (bits == 1) {
        file_ << (value != 0 ? '1' : '0') << code_of(signal) << '\n';
        return;
    }
    file_ << 'b';
    for (int bit = bits - 1; bit >= 0; bit--) file_ << (value >> bit & 1);
    file_ << ' ' << code_of(signal) << '\n';
}

}  // namespace kilotwin
