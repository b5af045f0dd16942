/// The trail of a run: which frames reached robots and cells, and which code of robots set what
/// they show, how they drive and what they send. `kilotwin why` repeats a run with it, and
/// `record.messages` has its first part.
///
/// Nothing of it changes what a run does. A run without one pays a test of a pointer for each
/// frame that is received and for each message that a program takes. Stores are told only by a
/// translation that was made for it (TRANSLATED_WATCHED, translated/code.h), so that they cost
/// nothing elsewhere. Of each list the newest `capacity` entries, or up to twice as many, are kept.
#ifndef KILOTWIN_ROBOTS_TRAIL_H
#define KILOTWIN_ROBOTS_TRAIL_H

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "base/events.h"
#include "base/slots.h"
#include "message.h"

namespace kilotwin {

class Trail {
  public:
    /// Senders and receivers. ABOVE: an overhead controller, by number. COMMAND: a [[command]],
    /// which comes beside the medium. FLOOR: what stands in for a foot-bot's ground sensor.
    enum class Kind : uint8_t { ROBOT, CELL, BEACON, ABOVE, COMMAND, FLOOR };
    struct Station {
        Kind kind;
        uint32_t number;
    };
    /// Data bytes and type.
    using Bytes = std::array<uint8_t, offsetof(message_t, crc)>;

    /// A frame that has reached a receiver: it began and ended then, in world time.
    struct Arrival {
        Cycles begin, at;
        Station from, to;
        Bytes bytes;
    };

    /// The kind of change that is written down. CALLBACK: of a variable, by the callback that got a
    /// message. MESSAGE: of a byte of a message that is sent. ASKED: of the variable that is looked
    /// at closely.
    enum class What : uint8_t { LED, MOTORS, CALLBACK, MESSAGE, ASKED };
    /// The interrupt in which the code ran.
    enum class During : uint8_t { LOOP, TICK, MESSAGE };

    /// A number that a program has drawn, or a reading that it has taken. `path`: index of paths().
    struct Input {
        Cycles at = NEVER;  ///< NEVER: none
        uint32_t path = 0;
        int32_t value = 0;
    };

    /// A change.
    struct Write {
        Cycles at;               ///< world time
        Cycles before = NEVER;   ///< when the same was last changed; NEVER: not before
        Cycles heard = NEVER;    ///< end of the frame that the callback got, of During::MESSAGE
        uint32_t heard_nth = 0;  ///< of several that ended then, the number of the one
        Input drawn = {}, sensed = {};  ///< the last ones of this robot before
        uint32_t robot = 0;
        uint32_t tick = 0;  ///< its kilo_ticks
        uint32_t path = 0;  ///< where its code was: index of paths()
        uint32_t sent = 0;  ///< of What::MESSAGE, Sending::number
        uint16_t address = 0, was = 0, now = 0;
        What what = What::ASKED;
        During during = During::LOOP;
    };

    /// A robot sends what it has not sent the last time, from `address` in its data space.
    struct Sending {
        Cycles at;
        uint32_t robot, number;
        uint16_t address;
        Bytes bytes;
    };

    /// The moment of a robot's code.
    struct Moment {
        Cycles at;
        uint32_t tick;
        During during;
    };

    /// `cells` and `beacons` as stations are numbered behind robots (simulation/creation.cpp),
    /// which have their slots. `slots` must live on.
    Trail(const Slots &slots, uint32_t beacons, uint32_t cells, size_t capacity);

    /// Byte addresses of code that draws random numbers: [begin, end), of one robot.
    void draws(uint32_t robot, std::vector<std::pair<uint32_t, uint32_t>> extents);
    /// A variable of one robot, of which each pass is executed then, also where passes repeat.
    struct Closely {
        uint32_t robot = UINT32_MAX;
        uint16_t begin = 0, end = 0;  ///< addresses in data space: [begin, end)
    };
    void look(const Closely &at) { closely_ = at; }
    bool looks_closely_at(uint32_t robot) const { return robot == closely_.robot; }

    /// A station of the Kilobots' channel.
    Station station(uint32_t number) const;
    Station cell(uint32_t number) const { return {Kind::CELL, number}; }

    // The channels.
    void arrived(Station from, Station to, Cycles begin, Cycles at, const message_t &message);

    // Robots: what their code does.

    /// The program's callback begins, for the message that came at `at`.
    void hears(uint32_t robot, Cycles at);
    void stored(uint32_t robot, const Moment &moment, uint16_t address, uint8_t was, uint8_t now,
                const CodePath &code);
    void sensed(uint32_t robot, Cycles at, int reading, const CodePath &code);
    void shows(uint32_t robot, const Moment &moment, uint8_t was, uint8_t now,
               const CodePath &code) {
        changed(What::LED, robot, moment, was, now, code);
    }
    void drives(uint32_t robot, const Moment &moment, uint16_t was, uint16_t now,
                const CodePath &code) {
        changed(What::MOTORS, robot, moment, was, now, code);
    }
    void sends(uint32_t robot, Cycles at, uint16_t address, const message_t &message);

    // Results.
    std::vector<Arrival> take_arrivals() { return std::exchange(arrivals_, {}); }
    const std::vector<Write> &writes() const { return writes_; }
    const std::vector<Sending> &sendings() const { return sendings_; }
    /// Addresses of code, the innermost first (CodePath).
    const std::vector<CodePath> &paths() const { return paths_; }
    /// Entries that had to go.
    uint64_t forgotten() const { return forgotten_; }

  private:
    struct OfRobot {
        std::vector<Write> last;  ///< by address from SRAM on
        std::vector<std::pair<uint32_t, uint32_t>> draws;
        Cycles heard = NEVER;
        uint32_t heard_nth = 0;
        Input drawn, sensed;
        Cycles shown = NEVER, driven = NEVER;
        Bytes sent{};
        bool has_sent = false;
    };

    template <typename T> void keep(std::vector<T> &list, const T &entry);
    void changed(What what, uint32_t robot, const Moment &moment, uint16_t was, uint16_t now,
                 const CodePath &code);
    Write write_of(OfRobot &of, uint32_t robot, const Moment &moment, const CodePath &code);
    uint32_t number_of(const CodePath &code);

    const Slots &slots_;
    uint32_t beacons_from_, cells_from_, above_from_;
    Closely closely_;
    size_t capacity_;
    uint64_t forgotten_ = 0;
    uint32_t sendings_so_far_ = 0;
    std::vector<OfRobot> robots_;
    std::vector<Arrival> arrivals_;
    std::vector<Write> writes_;
    std::vector<Sending> sendings_;
    std::vector<CodePath> paths_;
    std::map<CodePath, uint32_t> numbers_;
};

}  // namespace kilotwin

#endif
