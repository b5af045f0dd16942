/// One run: robots, their world, the channel and the floor, in one loop of world steps.
///
/// A world step (1, 2 or 4 ticks) goes: (1) commands are given, lists of neighbours kept; (2) the
/// channel executes what needs the order of time among its stations (infrared/channel.h); (3)
/// robots that something may have reached are executed up to their lookahead, the earliest moment
/// at which anything can reach them; (4) the channel delivers what is left of the step; (5) bodies
/// move, in closed form or, near a contact, by the solver. What a robot is not executed for cannot
/// have happened: run-ahead changes the cost of a run, never its result.
///
/// Nothing here depends on the medium or on the kind of a station: creation.cpp puts them together.
#ifndef KILOTWIN_SIMULATION_SIMULATION_H
#define KILOTWIN_SIMULATION_SIMULATION_H

#include <algorithm>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "avr/boards/boards.h"
#include "base/chance.h"
#include "base/clock.h"
#include "base/events.h"
#include "base/memory.h"
#include "base/prefetch.h"
#include "base/slots.h"
#include "base/team.h"
#include "grid/grid.h"
#include "infrared/beacons.h"
#include "infrared/channel.h"
#include "infrared/kilobot_channel.h"
#include "infrared/station.h"
#include "infrared/virtual_floor.h"
#include "modules/guest_modules.h"
#include "physics/arena.h"
#include "physics/bodies.h"
#include "physics/chassis.h"
#include "physics/light.h"
#include "robots/robot.h"
#include "robots/translated/debugging.h"
#include "robots/translated/written_bytes.h"
#include "simulation/commands.h"
#include "simulation/floor_sensing.h"
#include "simulation/recorder.h"
#include "simulation/result_hash.h"

namespace kilotwin {

/// Everything that makes a run. Resolved and checked by the host, whose schema is the only home of
/// defaults, ranges and meanings (host_tools/kilotwin/experiment/schema.py): no setting has a value
/// of its own here, so fill in every field. What only the engine can find throws EngineError.
struct SimulationDef {
    struct Group {
        std::string program;      ///< path of the guest, or of the .hex or .elf for a board
        std::string name;         ///< of the program, in events
        size_t count;             ///< robots
        std::vector<Pose> poses;  ///< empty: placed at random
        Tier tier;                ///< on boards with the Kilobot medium only
    };
    /// A robot on a board that gdb controls, by `port` on 127.0.0.1.
    struct Debugged {
        size_t robot;
        uint16_t port;
    };
    /// EEPROM of a lab's robot.
    struct LabRobot {
        uint16_t uid;
        uint8_t turn_left, turn_right, straight_left, straight_right;
        std::optional<gain_tables_t> gains;  ///< none: synthetic ones, as other robots have
    };
    using Command = kilotwin::Command;

    uint64_t seed;
    uint32_t step_ticks;  ///< 1, 2 or 4
    Arena arena;
    Profile profile;
    std::optional<VirtualFloor::Settings> floor;
    double range_m;                                          ///< of the ideal medium
    bool line_of_sight;                                      ///< of the ideal medium
    std::optional<KilobotChannel::Settings> kilobot_medium;  ///< instead of the ideal one
    std::optional<Grid::Settings> grid;                      ///< a Kilogrid below the robots
    uint32_t on_ticks;   ///< kilo_ticks that robots have counted before, but boards
    int64_t lead_ticks;  ///< engine time before RUN, for the grid's host; rounded up to 4
    Light light;
    double battery_h;           ///< hours of driving that a full battery lasts; 0: it never drains
    Readings readings;          ///< of sensors that read the same for all robots
    double clock_spread;        ///< sd of the robots' oscillators, share
    double sensitivity_spread;  ///< sd of the robots' receivers, share
    std::vector<ObjectDef> objects = {};
    std::vector<BeaconDef> beacons = {};  ///< of these objects
    std::vector<Group> groups;
    std::vector<LabRobot>
        lab;  ///< by index, one for each robot; empty: uid index + 1, the profile's duties
    std::vector<Command> commands;
    std::vector<RobotFault> faults = {};
    /// The region that each overhead controller covers; empty: there is one, over all robots.
    std::vector<Region> overhead = {};
    /// From one sample to the next, from RUN on. Each is taken at the end of the world step in
    /// which it is due; of several that are due in one step only one is.
    uint32_t sample_ticks;
    SampleExtras sample_extras;  ///< of these samples; changes no result
    std::string black_box;       ///< path of a file to map, or empty
    /// None, or one with which nothing goes on, from the lead on, until gdb says so.
    std::optional<Debugged> debugged = {};
    bool run_ahead;              ///< false: tick by tick, for tests
    bool recalls_passes = true;  ///< false: translated robots execute each pass, for tests
    /// That step the world, 1 to BlackBox::MOST_SHARES, or fewer where more cannot help: as many as
    /// there are robots, and one with boards. Changes no result.
    uint32_t threads = 1;
    /// Robots are kept by place where there are so many; by index where there are fewer, or boards
    /// (base/slots.h).
    size_t kept_by_place_from = 4000;
};

/// Numbers that a run adds up, from the begin on.
struct Statistics {
    uint64_t steps = 0;                 ///< world steps
    ChannelCounts medium;               ///< frames
    std::optional<uint64_t> delivered;  ///< that programs got; not known of boards
    uint64_t solver_steps = 0;          ///< bodies near a contact, times steps
    uint64_t island_steps = 0;          ///< of these, bodies that the contact solver moved
    uint64_t list_rebuilds = 0;         ///< neighbour lists made anew
    Overlaps overlaps;                  ///< of robots in contact
};

class Simulation {
  public:
    /// Creates and boots everything, up to the lead before RUN. EngineError for what only the
    /// engine can find: a program that cannot be loaded, robots that do not fit, boards on the
    /// ideal medium.
    explicit Simulation(const SimulationDef &def);
    ~Simulation();

    /// Goes on by at least `ticks`, to the end of a world step. Where a call ends changes nothing:
    /// a run that is cut up is the same run. What is due at the end of a step is sampled by then,
    /// before the host can do anything at that moment.
    void advance(int64_t ticks);

    /// The tick at which a simulation of this definition begins.
    static int64_t first_tick(const SimulationDef &def);

    /// Nominal ticks since RUN, which happens at 0.
    int64_t tick() const { return tick_of(now_); }

    /// Nominal ticks since RUN of a moment, rounded down.
    int64_t tick_of(Cycles at) const;
    /// The begin of the next world step.
    Cycles now() const { return now_; }
    /// Since t = 0, when the experiment begins.
    double seconds_of(Cycles at) const {
        return static_cast<double>(static_cast<int64_t>(at - run_at_)) * CYCLE_S;
    }

    /// Gives robots a message now, from outside the channel. `command.tick` does not matter.
    void send(const Command &command) { give(command, now_); }

    /// Takes a robot away to `pose`, between two steps: as if by hand, but at once. Frames on air
    /// go to those that they had reached. A grid's cells look for it within 16 ticks. EngineError
    /// where it has no room.
    void place(size_t robot, const Pose &pose);
    /// The same where it stands: it gets another heading only.
    void turn(size_t robot, double heading);

    /// A frame of an overhead controller begins at `at`, or now if that is over: light on all
    /// robots that it covers. EngineError if there is no such controller. On the Kilobot medium it
    /// meets their own (infrared/light_from_above.h), with the ideal one all robots receive it if
    /// its CRC is right.
    void shine_from_above(const message_t &message, Cycles at, uint32_t controller = 0);

    /// Ambient light from now on, as a reading; and what a lamp of the definition adds right below
    /// it. EngineError if there is no such lamp.
    void set_ambient(double reading);
    void set_peak(size_t lamp, double reading);

    /// Queues a frame at the host's node of a bus now; false if its queue is full. EngineError
    /// without a grid, or such a bus.
    bool send_can(uint32_t bus, const CanFrame &frame) { return grid().send_can(now_, bus, frame); }
    /// EngineError without one.
    Grid &grid();
    const Grid &grid() const;

    /// How many robots there are, and one of them, by index below that.
    size_t size() const { return robots_.size(); }
    size_t objects() const { return def_.objects.size(); }  ///< how many there are
    const Robot &robot(size_t index) const {
        return robots_[slots_.slot_of(static_cast<uint32_t>(index))];
    }
    const Boards &boards() const { return boards_; }
    /// The same, for tests and profiles.
    Boards &boards() { return boards_; }

    /// Writes what the pins of a robot on a board do from now on to a VCD file. EngineError for
    /// other robots.
    void trace(size_t robot, const std::string &path) { boards_.board_of(robot).trace(path); }

    /// The samples since the last call.
    Samples take_samples();
    /// One sample of this moment; those that take_samples() returns do not change.
    Samples snapshot() const { return snapshot(def_.sample_extras); }
    Samples snapshot(const SampleExtras &extras) const;
    /// Events before now since the last call, in order of time.
    Events take_events();
    Events take_module_events();  ///< likewise of a grid's modules; EngineError without one
    Statistics statistics() const;

    /// Hash of all that was sampled, printed, sent and failed up to now, fetched or not.
    uint64_t result_hash();

    /// Frames of each robot.
    std::vector<FrameCounts> frames() const;

    /// From now on the messages that programs of these robots get are written down, if they run
    /// natively.
    void listen_to(const std::vector<uint32_t> &robots);
    /// Those before now, in order of time.
    std::vector<Heard> heard_by(uint32_t robot) const;

    /// From now on a trail is kept (robots/trail.h); of what robots' code does too if `of_code`.
    Trail &keep_trail(size_t capacity, bool of_code);
    /// EngineError if none is kept.
    Trail &trail() const;
    /// A debugger takes hold of these robots, which run translated, and lets go of all others:
    /// between two calls of advance(). `on_stop` must not throw. EngineError for other robots.
    void hold(const std::vector<uint32_t> &robots,
              std::function<void(const Debugging::Stop &)> on_stop);
    /// From now on it is noted which bytes of a robot's SRAM change, between two calls of
    /// advance(). EngineError for a robot that no debugger can hold.
    void note_written(uint32_t robot);
    /// Those since then, or since the last call. EngineError if none are noted.
    WrittenBytes::Bytes take_written();
    /// EngineError if none was held so far.
    Debugging &debugging() const;
    /// The last place up to now at which something was wanted of robots that are held.
    std::optional<Debugging::Found> found() const;
    /// The chip of a robot that runs translated, in the midst of a step too. EngineError likewise.
    Driver::Standing standing(uint32_t robot) const;
    /// World time of a robot's own cycle, and the cycle at a moment since t = 0.
    Cycles moment_of(uint32_t robot, uint64_t cycle) const;
    uint64_t own_cycle(uint32_t robot, double at_s) const;

    /// Seconds that a robot's motors were on so far while neither turned.
    double hummed_s(uint32_t robot) const { return bodies_.hummed_s(slots_.slot_of(robot)); }

  private:
    uint32_t slot_of(size_t robot) const;       ///< EngineError if there is no such robot
    void put(uint32_t slot, const Pose &pose);  ///< where there is room

    struct Places {
        std::vector<Pose> poses;  ///< by slot
        std::vector<PlacedObject> objects;
    };

    /// Robots that one member of the team executes (base/team.h), and what they leave behind.
    struct alignas(64) Share {
        Share(uint32_t number, const Chance &chance, const SimulationDef &def, BlackBox *black_box);

        Events events;                    ///< not taken yet, in order of execution
        std::vector<Emission> emissions;  ///< of the robot executed last; the channel takes them
        RobotContext context;             ///< what its robots share
        std::vector<uint32_t> due;        ///< robots to be executed in this step
        std::vector<Cycles> until;        ///< of each: how far
        Listening listening;              ///< of its robots, those that are listened to
    };

    // Creation, in creation.cpp, in this order; one of the two channels.
    static uint32_t threads_of(const SimulationDef &def);
    const RobotContext &create_shares();
    Places create_robots();
    Slots slots_for(const std::vector<Pose> &poses) const;
    std::unique_ptr<Driver> make_driver(const SimulationDef::Group &group, uint32_t first);
    /// Differences from robot to robot: oscillator, receiver, uid.
    Calibration calibrate(uint32_t index) const;
    Bodies create_bodies(const Places &places);
    ModuleDriver &create_module_driver(const Grid::Settings &grid);
    void create_kilobot_channel();
    void create_ideal_channel();
    /// From power-up to start_.
    void boot();

    void note_work(bool goes_on);  ///< in the black box

    /// One world step; no robot is executed beyond `limit`.
    void step(Cycles limit);
    void break_robots();  ///< those that are due to fail
    void break_robot(const RobotFault &fault);
    void give_commands(Cycles until);
    /// Delivers a command at `at`, not earlier than now_, to the robots it is for.
    void give(const Command &command, Cycles at);
    void sense_on_boards();
    void tell_ahead_of_channel(Cycles end);
    void run_due_robots(Cycles limit);
    void find_due(Share &share, size_t begin, size_t end, Cycles limit);
    void run_share(Share &share);
    void prefetch_lookahead_after(const Share &share, size_t i) const;
    void prefetch_due_after(const Share &share, size_t i) const;
    /// Through this step, and on up to a robot's lookahead, at most `limit`.
    Cycles run_until(uint32_t robot, Cycles limit);
    void ran_ahead(uint32_t robot, Cycles until);
    void wake_when_due(uint32_t robot, Cycles until);
    /// Whether something notes what robots do in the order in which they are executed.
    bool notes_in_order() const;
    void gather_events();
    /// Hands what a robot has ordered of its motors to the bodies and the floor.
    void take_motor_commands(uint32_t robot);
    bool light_changes() const { return !def_.light.is_even(); }
    void shine_on_robots();  ///< the light of the definition, at once
    /// Not where light depends on the place: how long a robot will stay where it is is not known.
    bool may_run_ahead() const { return def_.run_ahead && !light_changes(); }
    /// Takes a sample if one is due by the step that begins now.
    void sample_if_due();
    void sample_into(Samples &samples, const SampleExtras &extras) const;
    void add_extras(Samples &samples, const SampleExtras &extras) const;
    void fetch_module_events();

    SimulationDef def_;
    Chance chance_;
    Cycles step_;                    ///< length of a world step
    Cycles run_at_;                  ///< when RUN is given: t = 0
    Cycles start_;                   ///< when stepping begins: before, robots wait for commands
    Cycles now_;                     ///< begin of the current step
    Cycles next_sample_;             ///< when the next is due, a begin of a step
    Events events_;                  ///< gathered from the shares, and not taken yet
    Events module_events_;           ///< fetched from the grid, and not taken yet
    BlackBox *black_box_ = nullptr;  ///< mapped file that tells which robots run, or null
    Team team_;
    std::deque<Share> shares_;
    Slots slots_{0};                                   ///< of all robots, once they are created
    std::unique_ptr<Trail> trail_;                     ///< null: none is kept
    std::unique_ptr<Debugging> debugging_;             ///< null until a robot is held
    std::unique_ptr<WrittenBytes> written_;            ///< null: none are noted
    std::vector<std::unique_ptr<Driver>> drivers_;     ///< by group
    Swarm<Robot> robots_;                              ///< by slot; those on boards too
    Boards boards_;                                    ///< empty without chips
    Schedule<Command> commands_;                       ///< of the definition, those to come
    Schedule<RobotFault> faults_;                      ///< likewise
    Bodies bodies_;                                    ///< of all robots, and of objects
    FloorSensing floor_;                               ///< may sense nothing
    std::optional<GuestModules> guest_modules_;        ///< of a Kilogrid without boards
    std::optional<Grid> grid_;                         ///< only with a Kilogrid
    std::unique_ptr<Channel> channel_;                 ///< the medium
    std::vector<std::unique_ptr<Stations>> stations_;  ///< but for robots as guests

    Swarm<Cycles> wake_;  ///< by slot: the begin of the step in which it next is due
    Samples samples_;     ///< since the last take_samples()
    ResultHash result_;   ///< of all samples, and of events that were taken
    uint64_t steps_ = 0;  ///< world steps so far
};

}  // namespace kilotwin

#endif
