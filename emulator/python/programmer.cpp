#include "python/programmer.h"

#include <algorithm>

#include "avr/boards/stk500v2.h"

namespace nb = nanobind;

namespace kilotwin {

namespace {

/// A programmer, and the chip that it is plugged to.
struct PythonProgrammer {
    ChipMemory memory;
    Stk500v2 programmer{memory};
};

nb::bytes bytes_of(const auto &array) { return nb::bytes(array.data(), array.size()); }

// ValueError if there are more bytes or fewer than the memory has.
void fill(auto &array, const nb::bytes &bytes) {
    if (bytes.size() != array.size()) throw nb::value_error("not as long as the chip's memory");
    const auto *data = static_cast<const uint8_t *>(bytes.data());
    std::copy_n(data, array.size(), array.begin());
}

// Low, high, extended.
nb::bytes fuses_of(const ChipMemory &memory) {
    return bytes_of(
        std::array<uint8_t, 3>{memory.low_fuse, memory.high_fuse, memory.extended_fuse});
}

void set_fuses(ChipMemory &memory, const nb::bytes &bytes) {
    std::array<uint8_t, 3> fuses{};
    fill(fuses, bytes);
    memory.low_fuse = fuses[0];
    memory.high_fuse = fuses[1];
    memory.extended_fuse = fuses[2];
}

}  // namespace

// Each property is one memory of the chip as bytes, to read and to set whole.
void register_programmer(nb::module_ &m) {
    using P = PythonProgrammer;
    nb::class_<P>(m, "Programmer",
                  "An STK500v2 in front of an erased chip; see emulator/avr/boards/stk500v2.h.")
        .def(nb::init<>())
        .def(
            "receive",
            [](P &self, const nb::bytes &bytes) {
                const auto *data = static_cast<const uint8_t *>(bytes.data());
                return bytes_of(self.programmer.receive({data, bytes.size()}));
            },
            nb::arg("bytes"), "What the PC sends, as it comes; returns what it answers.")
        .def("hang_up", [](P &self) { self.programmer.hang_up(); })
        .def_prop_ro("programming", [](const P &self) { return self.programmer.programming(); })
        .def_prop_rw(
            "flash", [](const P &self) { return bytes_of(self.memory.flash); },
            [](P &self, const nb::bytes &bytes) { fill(self.memory.flash, bytes); })
        .def_prop_rw(
            "eeprom", [](const P &self) { return bytes_of(self.memory.eeprom); },
            [](P &self, const nb::bytes &bytes) { fill(self.memory.eeprom, bytes); })
        .def_prop_rw(
            "fuses", [](const P &self) { return fuses_of(self.memory); },
            [](P &self, const nb::bytes &bytes) { set_fuses(self.memory, bytes); },
            "Low, high and extended fuse byte.")
        .def_prop_rw(
            "lock_bits", [](const P &self) { return self.memory.lock_bits; },
            [](P &self, uint8_t bits) { self.memory.lock_bits = bits; })
        .def_prop_rw(
            "signature", [](const P &self) { return bytes_of(self.memory.signature); },
            [](P &self, const nb::bytes &bytes) { fill(self.memory.signature, bytes); });
}

}  // namespace kilotwin
