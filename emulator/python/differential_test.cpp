#include "python/differential_test.h"

#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <memory>

#include "avr/differential_test.h"
#include "base/errors.h"
#include "python/specification.h"
#include "robots/native/driver.h"
#include "robots/translated/driver.h"

namespace nb = nanobind;

namespace kilotwin {

namespace {

using Entries = std::optional<std::vector<uint16_t>>;
using HeardMessages = std::vector<std::tuple<uint32_t, nb::bytes, uint8_t>>;
using Sums = std::vector<std::pair<uint16_t, bool>>;  // addresses, and the carry that is told

// `follow`: addresses of functions to watch on the chip; None watches nothing, which is faster.
DifferentialTest::Settings settings_of(uint64_t seed, uint16_t uid,
                                       const std::vector<nb::bytes> &before_run, double slack_s,
                                       bool waits, Entries follow, const Sums &sums,
                                       const HeardMessages &heard, uint32_t ask_every) {
    DifferentialTest::Settings settings;
    settings.seed = seed;
    settings.uid = uid;
    for (const nb::bytes &bytes : before_run) settings.before_run.push_back(message_of(bytes));
    settings.slack = static_cast<Cycles>(slack_s * static_cast<double>(CYCLES_PER_SECOND));
    settings.waits = waits;
    settings.follow = std::move(follow);
    for (const auto &[at, carry] : sums) settings.sums.push_back({at, carry});
    for (const auto &[tick, bytes, mm] : heard)
        settings.heard.push_back({tick, message_of(bytes), mm});
    settings.ask_every = ask_every;
    return settings;
}

// None while both agree.
nb::object to_python(const std::optional<DifferentialTest::Difference> &difference) {
    if (!difference) return nb::none();
    nb::dict out;
    out["tick"] = difference->tick;
    static const char *const KINDS[] = {"led", "motors", "message"};
    out["kind"] = KINDS[difference->kind];
    out["text"] = difference->text();
    return out;
}

// None if nothing is watched. `calls`: by a function's address how often it was called, its longest
// call in cycles, and the tick of that one.
/// Stack, room, calls and sums on the chip. By a function's entry: its calls, cycles of the
/// longest, its tick; and the addresses that called it, with the first tick. By address: the first
/// carry.
nb::object watched(const DifferentialTest &test) {
    const CallWatch *watch = test.watch();
    if (watch == nullptr) return nb::none();
    nb::dict out;
    out["stack_bytes"] = watch->deepest();
    out["deepest_at"] = watch->deepest_at();
    out["room_bytes"] = watch->room();
    out["ticks_lost"] = test.ticks_lost();
    nb::dict calls, callers, sums;
    for (const auto &call : watch->calls()) {
        calls[nb::int_(call.entry)] = nb::make_tuple(call.calls, call.longest, call.tick);
        callers[nb::int_(call.entry)] = nb::cast(call.callers);
    }
    for (const auto &[at, sum] : watch->sums())
        if (sum.tick != 0) sums[nb::int_(at)] = sum.tick;
    out["calls"] = calls;
    out["callers"] = callers;
    out["sums"] = sums;
    return out;
}

// Mistakes and failures are told by native_failure().
nb::list native_prints(const DifferentialTest &self) {
    nb::list out;
    for (const Event &event : self.native_events())
        if (event.kind == EventKind::PRINT) out.append(nb::make_tuple(event.tick, event.text));
    return out;
}

/// The driver of one robot with that program.
std::unique_ptr<Driver> driver_of(const std::string &tier, const std::string &guest,
                                  const std::string &name) {
    switch (tier_of(tier)) {
    case Tier::NATIVE:
        return std::make_unique<NativeDriver>(std::vector{&Program::load(guest, name)}, 1);
    case Tier::TRANSLATED:
        return std::make_unique<TranslatedDriver>(TranslatedProgram::load(guest, name), 1, 1);
    default: throw EngineError("a chip is compared with a native or a translated program");
    }
}

}  // namespace

// Both programs are built by the host: the same source for the PC and for the robot.
void register_differential_test(nb::module_ &m) {
    nb::class_<DifferentialTest>(m, "DifferentialTest",
                                 "One program, native and on an ATmega328P, compared; see "
                                 "emulator/avr/differential_test.h.")
        .def(
            "__init__",
            [](DifferentialTest *self, const std::string &guest, const std::string &tier,
               const std::string &elf, const std::string &name, uint64_t seed, uint16_t uid,
               const std::vector<nb::bytes> &before_run, double slack_s, bool waits, Entries follow,
               const Sums &sums, const HeardMessages &heard, uint32_t ask_every) {
                new (self) DifferentialTest(driver_of(tier, guest, name), FlashImage::load(elf),
                                            settings_of(seed, uid, before_run, slack_s, waits,
                                                        std::move(follow), sums, heard, ask_every));
            },
            nb::kw_only(), nb::arg("guest"), nb::arg("tier"), nb::arg("elf"), nb::arg("name"),
            nb::arg("seed"), nb::arg("uid"), nb::arg("before_run"), nb::arg("slack_s"),
            nb::arg("waits"), nb::arg("follow").none(), nb::arg("sums") = Sums(),
            nb::arg("heard") = HeardMessages(), nb::arg("ask_every") = 0,
            "Built by guest_build and avr_build; `tier` is the guest's. `before_run`: messages, "
            "nine data bytes and the "
            "type each; `ask_every`: ticks from question to question for vitals, 0 none.")
        .def(
            "run", [](DifferentialTest &self, uint32_t ticks) { self.run(ticks); },
            nb::arg("ticks"), nb::call_guard<nb::gil_scoped_release>(),
            "Run both by `ticks`, or until one cannot go on.")
        .def_prop_ro("tick", &DifferentialTest::tick)
        .def_prop_ro("compared", &DifferentialTest::compared)
        .def_prop_ro("received", &DifferentialTest::received)
        .def_prop_ro("chip_sent", &DifferentialTest::chip_sent)
        .def_prop_ro("chip_sent_badly", &DifferentialTest::chip_sent_badly)
        .def_prop_ro("hummed_s", &DifferentialTest::hummed_s)
        .def_prop_ro("worst_lag_s",
                     [](const DifferentialTest &self) { return seconds(self.worst_lag()); })
        .def_prop_ro("ticks_apart", &DifferentialTest::ticks_apart)
        .def_prop_ro("difference",
                     [](const DifferentialTest &self) { return to_python(self.difference()); })
        .def_prop_ro("avr_failure", &DifferentialTest::avr_failure)
        .def_prop_ro("native_failure", &DifferentialTest::native_failure)
        .def_prop_ro("native_prints", native_prints,
                     "Texts that the native robot printed, and the tick of each.")
        .def_prop_ro("watched", watched,
                     "Stack and calls on the chip; None unless it is followed.");
}

}  // namespace kilotwin
