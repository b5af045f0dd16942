/// A Kilogrid module without a grid, for tests of modules and their programs.
#ifndef KILOTWIN_TESTS_MODULE_BENCH_H
#define KILOTWIN_TESTS_MODULE_BENCH_H

#include <algorithm>
#include <functional>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "modules/module.h"
#include "support.h"

namespace kilotwin::testing {

constexpr Cycles MS = CYCLES_PER_SECOND / 1000;
constexpr Cycles AWAKE = 1300 * MS;  // main() is through with the lights' show
constexpr Cycles SECOND = CYCLES_PER_SECOND;
constexpr uint8_t X = 3, Y = 7;

// Types of CAN frames (hardware.md 3.2).
enum : uint8_t {
    FORWARD = 0x01,
    STOP = 0x02,
    PAGE = 0x03,
    PAGES = 0x04,
    PAGE_NUMBER = 0x05,
    TO_LOADER = 0x06,
    GO_IDLE = 0x0B,
    GO_SETUP = 0x0C,
    GO_RUN = 0x0D,
    PAUSE = 0x0E,
    CONFIG_SIZE = 0x0F,
    CONFIG = 0x10,
    TRACKED = 0x11,
    HEALTH = 0x13,
    TRACKED_START = 0x14,
    POLL = 0x15,
};
enum : uint8_t { TRACKING = 0x10, DROP = 0x21, CELL_STATE = 1 };

inline CanFrame frame(std::initializer_list<uint8_t> data, uint8_t dlc = 8) {
    CanFrame made;
    made.dlc = dlc;
    std::copy(data.begin(), data.end(), made.data.begin());
    return made;
}

/// One module without a grid: every frame it wants to send is answered by `channel`.
struct ModuleBench {
    explicit ModuleBench(const std::string &program, Cycles power_up = 0)
        : loaded(Program::load(guest(program), program)),
          image(loaded.state_bytes()),
          module(context, loaded, 5, X, Y, TICK_CYCLES, power_up, image.data()) {
        Module::serve_this_thread();
    }

    void run(Cycles until) {
        while (module.run(until) < until || module.asks()) {
            const auto said = channel(module.outgoing());
            if (said == Module::Answer::SENT) sent.push_back(module.outgoing());
            module.answer(said);
        }
        for (const auto &output : module.can_frames) frames.push_back(output);
        module.can_frames.clear();
        now = until;
    }
    void run_for(Cycles time) { run(now + time); }

    void tell(const CanFrame &what) {
        module.receive_can(now, what);
        run_for(MS);
    }
    void tell(std::initializer_list<uint8_t> data) { tell(frame(data)); }

    void configure(std::initializer_list<uint8_t> bytes) {
        tell({CONFIG_SIZE, 0, static_cast<uint8_t>(bytes.size())});
        std::vector<uint8_t> all(bytes);
        for (uint8_t part = 0; part * 6u < all.size(); part++) {
            CanFrame chunk = frame({CONFIG, part});
            for (size_t i = 0; i < 6 && part * 6u + i < all.size(); i++)
                chunk.data[2 + i] = all[part * 6u + i];
            tell(chunk);
        }
    }
    void start(std::initializer_list<uint8_t> configuration) {
        run(AWAKE);
        configure(configuration);
        tell({GO_RUN});
        run_for(300 * MS);
        sent.clear();
    }
    void hear(uint8_t cell, const message_t &what, bool crc_error = false) {
        module.receive_ir(now, cell, what, {40, 40}, crc_error);
        run_for(MS);
    }
    std::vector<CellEmission> sent_by(uint8_t cell) const {
        std::vector<CellEmission> found;
        for (const auto &emission : sent)
            if (emission.cell == cell) found.push_back(emission);
        return found;
    }

    Chance chance{1};
    Events events;
    ModuleContext context{chance, events};
    Program &loaded;
    std::vector<uint8_t> image;
    Module module;
    std::function<Module::Answer(const CellEmission &)> channel = [](const CellEmission &) {
        return Module::Answer::SENT;
    };
    std::vector<CellEmission> sent;
    std::vector<CanOutput> frames;
    Cycles now = 0;
};

inline message_t tracking(std::initializer_list<uint8_t> data) { return message(TRACKING, data); }

}  // namespace kilotwin::testing

#endif
