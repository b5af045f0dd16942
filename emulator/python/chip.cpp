#include "python/chip.h"

#include <nanobind/stl/map.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>

#include <map>
#include <utility>

#include "avr/boards/robot_board.h"
#include "base/errors.h"
#include "base/fnv.h"
#include "base/message_crc.h"
#include "infrared/infrared_pulses.h"
#include "infrared/robot_receiver.h"
#include "python/specification.h"

namespace nb = nanobind;

namespace kilotwin {

namespace {

// The host translates what it gets here, so an image that is refused goes to the engine as it is,
// which then says why.
std::pair<nb::bytes, std::map<uint16_t, uint8_t>> flash_image(const std::string &path) {
    const auto image = FlashImage::load(path);
    if (image->is_overhead_controllers())
        throw EngineError(path + ": an overhead controller's program");
    return {nb::bytes(image->bytes().data(), image->bytes().size()), image->eeprom()};
}

/// A robot's board without a world, and a record of what it has done.
class RobotChip {
  public:
    RobotChip(const std::string &path, uint64_t seed, bool skips, bool boots)
        : chance_(seed),
          image_(FlashImage::load(path)),
          board_(*image_, 0, {TICK_CYCLES, 1, 70, 71, 72, 73, InfraredGains()}, 0, chance_) {
        if (!skips) board_.skip_nothing();
        if (boots) board_.start_at_boot_section();
    }

    void run(Cycles until) { board_.run(until); }

    /// Shows it a message that begins at `at`, as an overhead controller does.
    void show(const nb::bytes &content, Cycles at) {
        message_t message = message_of(content);
        message.crc = crc_of(message);
        for (const Cycles offset : pulses_of(message))
            board_.shine(
                {at + offset, at + offset + RobotBoard::SEEN_PULSE, RobotReceiver::FROM_ABOVE});
    }

    /// A number for the data space between two addresses as it is, for flash and EEPROM, and for
    /// all that it has put out so far, with the times.
    uint64_t digest(uint16_t begin, uint16_t end) {
        note_outputs();
        uint64_t sum = outputs_;
        for (unsigned address = begin; address < end; address++)
            take_word(sum, board_.read(static_cast<uint16_t>(address)));
        for (const uint8_t byte : board_.flash_content()) take_word(sum, byte);
        for (const uint8_t byte : board_.eeprom()) take_word(sum, byte);
        return sum;
    }

    uint64_t cycle() const { return board_.cycle(); }
    uint32_t flash_operations() const { return board_.flash_operations(); }
    const std::string &failure() const { return board_.failure(); }

    /// Changes of LED and motors, edges of the infrared LED, and bytes sent, since power-up.
    nb::tuple outputs() {
        note_outputs();
        return nb::make_tuple(colors_, motors_, edges_, bytes_);
    }

  private:
    // Takes the board's outputs, so that they do not pile up.
    void note_outputs() {
        auto &out = board_.outputs;
        for (const auto &light : out.light) take_word(outputs_, light.at << 1 | light.on);
        for (const auto &motor : out.motors)
            take_word(outputs_, motor.at << 16 | motor.left << 8 | motor.right);
        for (const auto &color : out.colors) take_word(outputs_, color.at << 8 | color.rgb);
        for (const auto &serial : out.serial) take_word(outputs_, serial.at << 8 | serial.byte);
        colors_ += out.colors.size();
        motors_ += out.motors.size();
        edges_ += out.light.size();
        bytes_ += out.serial.size();
        out.clear();
    }

    // In this order: the board refers to the other two.
    Chance chance_;
    std::shared_ptr<const FlashImage> image_;
    RobotBoard board_;
    uint64_t outputs_ = FNV_OFFSET;
    size_t colors_ = 0, motors_ = 0, edges_ = 0, bytes_ = 0;
};

}  // namespace

void register_chip(nb::module_ &m) {
    m.def(
        "flash_image", flash_image, nb::arg("path"),
        "The flash of a robot's or module's .hex or .elf file, 32 KB, and the EEPROM's bytes that "
        "it gives, by address. EngineError for what the engine would not run.");
    nb::class_<RobotChip>(m, "RobotChip",
                          "One robot's ATmega328P on its board, without a world; for tests.")
        .def(
            nb::init<const std::string &, uint64_t, bool, bool>(), nb::arg("path"), nb::kw_only(),
            nb::arg("seed"), nb::arg("skips"), nb::arg("boots") = false,
            "Powered up. `skips`: time in which the program only waits is passed over; `boots`: it "
            "begins in its boot section.")
        .def("run", &RobotChip::run, nb::arg("until"), "Up to a moment in cycles of 125 ns.")
        .def("show", &RobotChip::show, nb::arg("message"), nb::arg("at"),
             "Nine data bytes and the type as light; none of a message before is still to come.")
        .def("digest", &RobotChip::digest, nb::arg("begin"), nb::arg("end"),
             "Of the data space between two addresses, flash, EEPROM, and all outputs so far.")
        .def_prop_ro("cycle", &RobotChip::cycle)
        .def_prop_ro("flash_operations", &RobotChip::flash_operations)
        .def_prop_ro("failure", &RobotChip::failure, "Empty while the program can go on.")
        .def_prop_ro(
            "outputs", &RobotChip::outputs,
            "How many changes of LED and motors, edges of infrared, and bytes there were.");
}

}  // namespace kilotwin
