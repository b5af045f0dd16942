/// A Kilogrid: modules, the CAN buses between them and the host, faults, and which robots are near
/// which cell.
///
/// Everything happens in order of time. Next is what comes first of: a frame that ends on a bus
/// (the lowest bus first), a fault, a module that may send (the lowest module first). A module is
/// executed only up to where it may send, and run ahead where nothing can reach it: while no robot
/// is near its cells, no frame of the host is in flight to it, and its program cannot address other
/// modules. Neither changes a result. Infrared that a station may receive is the channel's: run()
/// stops where a module is about to send (grid/cell_stations.h).
///
/// A module has an index, row by row from the lower left; a cell has one, too, four to a module. A
/// world with a grid belongs to one thread. Cost: O(log modules) for an event of a module, O(buses
/// + modules of the bus) for a frame on a bus.
#ifndef KILOTWIN_GRID_GRID_H
#define KILOTWIN_GRID_GRID_H

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/chance.h"
#include "base/clock.h"
#include "base/earliest.h"
#include "base/events.h"
#include "grid/can_bus.h"
#include "grid/cells.h"
#include "modules/driver.h"
#include "robots/tier.h"

namespace kilotwin {

/// Infrared between robots and cells. What each stands for, its default and what is assumed is in
/// the host's schema ([grid.cells]) and in docs/limits.md.
struct CellInfrared {
    /// A robot receives cells whose middle is so near to its own: all of a cell, to its corners.
    double cell_range_m;
    /// A cell receives robots so near to its middle. Decides how many cells a frame reaches, and so
    /// the share that is received at all (a receiver listens to one cell of four) and twice.
    double robot_range_m;
    /// Share of the time that a robot is hardly received, in spells of `weak_spell_s`, and how near
    /// it must be meanwhile: what gives the log its gaps of minutes.
    double weak_share;
    double weak_range_m;
    double weak_spell_s;
    /// Share of frames lost at a cell for no other reason.
    double loss;
    /// sd of the modules' oscillators, share. They are crystals.
    double clock_spread;
};

/// One per run with a `[grid]`.
class Grid final : private ModuleNodes {
  public:
    /// A fault of a module, and its time.
    struct Fault {
        enum class Kind : uint8_t {
            DEAD,     ///< power gone
            RESET,    ///< power gone for a moment
            BUS_OFF,  ///< the CAN controller, until RECOVER
            RECOVER,  ///< of DEAD or BUS_OFF
        };
        int64_t at_tick;  ///< since t = 0
        Kind kind;
        uint32_t x, y;  ///< module
    };

    struct Settings {
        uint32_t columns, rows, buses;  ///< of modules; rows are shared out among the buses
        std::string program;            ///< path of the guest, or of the .hex or .elf for boards
        std::string name;               ///< of the program
        CellInfrared infrared;          ///< Kilobots' channel; the ideal one takes the ranges
        std::vector<Fault> faults;      ///< in any order
        double error_share;             ///< of frames on the buses that a disturbance destroys
        Tier tier;                      ///< of all modules
    };

    /// A frame that ended on a bus.
    struct LoggedFrame {
        Cycles at;     ///< end of its last bit
        uint32_t bus;  ///< index
        CanFrame frame;
        bool from_host;
    };

    /// Infrared of the cells, since the world began.
    struct Counts {
        uint64_t sent = 0;       ///< frames of cells, and of these ...
        uint64_t unheard = 0;    ///< ... those that no robot was near enough to receive
        uint64_t put_off = 0;    ///< attempts that found the channel busy, or a frame coming in
        uint64_t received = 0;   ///< frames of robots that a cell received ...
        uint64_t collided = 0;   ///< ... or would have, but for another robot's
        uint64_t deaf = 0;       ///< ... but that its module was sending
        uint64_t elsewhere = 0;  ///< ... but that its module listened to another cell
        uint64_t lost = 0;       ///< ... but for chance
    };

    /// A module is about to send by infrared, and waits for answer().
    struct Question {
        uint32_t module;
        CellEmission emission;
    };

    /// Modules, executed by `driver`, are switched on between 0 and `power_up`. t = 0 of faults is
    /// `zero`. Without `run_ahead` no module is run farther than it must: the oracle of run ahead.
    /// EngineError for a grid that cannot be wired, a fault of a module that is not there.
    Grid(const Settings &settings, const Chance &chance, Cycles power_up, Cycles zero,
         bool run_ahead, ModuleDriver &driver);

    /// Where modules, cells and buses lie, and the ranges of infrared; constant during a run.
    const GridLayout &layout() const { return layout_; }
    const CellInfrared &infrared() const { return infrared_; }

    /// Finds the robots near each cell, from where they are now, m. Until `until` none moves
    /// farther than `way_m`; then this has to be called again. Time O(robots + cells).
    void look_around(Cycles until, double way_m, std::span<const Eigen::Vector2d> positions);

    /// Robots that may come within any range of `cell` before the next look_around(), ascending.
    const std::vector<uint32_t> &robots_near(uint32_t cell) const { return robots_near_[cell]; }
    /// Cells that `robot` may come near to, as far.
    const std::vector<uint32_t> &cells_near(uint32_t robot) const { return cells_near_[robot]; }

    /// How near to a cell's middle `robot` must be to be received there at `at`, m.
    double range_m(uint32_t robot, Cycles at) const;

    /// The host may send again at `limit`, not before.
    void no_host_before(Cycles limit) { limit_ = limit; }

    /// Queues a frame at the host's node of `bus` at `now`; false, and counted as lost, if the
    /// queue is full. EngineError for a bus that is not there.
    bool send_can(Cycles now, uint32_t bus, const CanFrame &frame);

    /// The earliest moment at which anything happens here.
    Cycles next() const { return std::min({next_fault(), due_.first_at(), bus_due_[first_bus_]}); }

    /// Executes everything strictly before `until`. Returns early when a module is about to send
    /// from a cell where a robot may receive it or be received.
    std::optional<Question> run(Cycles until);

    /// Fate of the frame that a module was about to send at `asked`; without meaning if it lost its
    /// power since.
    void answer(uint32_t index, Cycles asked, Module::Answer answer);

    /// Whether it has power.
    bool lives(uint32_t module) const { return !dead_[module]; }

    /// Lookahead: the earliest moment at which `module`, executed in the order of time, may be
    /// about to send; NEVER while it waits for an answer.
    Cycles next_event(uint32_t module) const { return due_.at(module); }

    /// A frame of a robot ends at `at`, at a cell that listened. All before `at` has been executed.
    void receive_ir(Cycles at, uint32_t cell, const message_t &message,
                    distance_measurement_t distance, bool crc_error);

    /// Colour of a cell at `at`, up to which everything has been executed.
    CellLight light(uint32_t cell, Cycles at);

    /// How a module is at `at`, up to which everything has been executed.
    ModuleDriver::About about(uint32_t index, Cycles at);

    /// Frames that ended on any bus since the last call, in order of time.
    std::vector<LoggedFrame> take_frames();
    /// Prints and failures of module programs in order of time, since the last call; `robot` is the
    /// module's index. Everything has been executed up to `at`.
    Events take_events(Cycles at);
    /// A bus, by index; the lowest rows are on bus 0.
    const CanBus &bus(uint32_t index) const { return buses_[index]; }
    /// Node of a module on its bus; the host is node 0 of each.
    uint32_t node(uint32_t module) const { return node_[module]; }

    Counts counts;

  private:
    static constexpr uint32_t HOST = 0;  ///< its node on each bus

    void create_modules(Cycles power_up);
    void attach_to_buses(double error_share);
    /// Whether nothing can reach it: no robot near, no frame of the host in flight to it.
    bool has_lookahead(uint32_t module) const;
    /// Executes a module that is due; what it asks if it is about to send near a robot.
    std::optional<CellEmission> attend(uint32_t index, Cycles at);
    // ModuleNodes.
    void queue(uint32_t module, const CanOutput &output) override;
    size_t queued(uint32_t module) const override;
    CanErrors errors(uint32_t module) const override;
    bool sends(uint32_t module) const override;
    CanBus &bus_of(uint32_t module) { return buses_[layout_.bus(module)]; }
    const CanBus &bus_of(uint32_t module) const { return buses_[layout_.bus(module)]; }
    void catch_up(uint32_t index, Cycles at);
    /// Finds anew when it is due.
    void schedule(uint32_t index, Cycles not_before = 0);
    void run_bus(uint32_t index, Cycles until);
    void schedule_bus(uint32_t bus);
    /// A frame has ended: hands it to the modules and to the log.
    void deliver(uint32_t bus, const CanBus::Delivery &delivery);
    template <typename Visit> void for_each_taker(uint32_t bus, uint16_t id, Visit visit) const;
    void end_flight(uint32_t bus, bool one);
    void apply(const Fault &fault, Cycles at);
    Cycles fault_time(const Fault &fault) const;
    Cycles next_fault() const {
        return next_fault_ < faults_.size() ? fault_time(faults_[next_fault_]) : NEVER;
    }

    GridLayout layout_;
    CellInfrared infrared_;
    const Chance &chance_;
    ModuleDriver &driver_;
    Cycles zero_;
    bool run_ahead_;
    std::deque<CanBus> buses_;
    std::vector<Fault> faults_;  ///< in order of time
    size_t next_fault_ = 0;
    std::vector<LoggedFrame> frames_;
    Cycles limit_ = 0;        ///< the host is silent until then
    Cycles lists_until_ = 0;  ///< robots_near_ and cells_near_ hold until then

    // By module.
    std::vector<uint32_t> node_;
    Earliest due_;  ///< when it has to be executed; NEVER while it waits for an answer
    std::vector<uint32_t> robots_about_;      ///< entries of its cells in robots_near_
    std::vector<uint32_t> frames_in_flight_;  ///< of the host, to it
    std::vector<bool> dead_;

    std::vector<Cycles> bus_due_;                        ///< by bus: its next event
    uint32_t first_bus_ = 0;                             ///< the one that is due first
    std::vector<std::vector<uint32_t>> module_of_node_;  ///< by bus and node
    std::vector<std::deque<uint16_t>> host_queue_;       ///< by bus: identifiers, first one first
    std::vector<std::vector<uint32_t>> robots_near_;     ///< by cell
    std::vector<std::vector<uint32_t>> cells_near_;      ///< by robot
};

}  // namespace kilotwin

#endif
