/// One run: robots, their world, the medium and the floor, stepped together.
///
/// A world step (1, 2 or 4 ticks) goes: (1) robots that something may have reached look around, are
/// told what the floor says and run ahead to the earliest moment at which anything can reach them;
/// (2) frames that began within the step find their listeners, who hear them from the next step on;
/// (3) bodies move, in closed form or, near a contact, by the solver. What a robot is not woken for
/// cannot have happened: run-ahead changes the cost of a run, never its result.
#ifndef KILOTWIN_SIMULATION_SIMULATION_H
#define KILOTWIN_SIMULATION_SIMULATION_H

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "avr/boards/boards.h"
#include "base/chance.h"
#include "base/clock.h"
#include "base/events.h"
#include "base/memory.h"
#include "base/message_crc.h"
#include "base/selection.h"
#include "grid/grid.h"
#include "guest/robot.h"
#include "infrared/ideal_medium.h"
#include "infrared/kilobot_medium.h"
#include "infrared/planned_frames.h"
#include "infrared/virtual_floor.h"
#include "physics/arena.h"
#include "physics/bodies.h"
#include "physics/chassis.h"
#include "physics/light.h"
#include "simulation/recorder.h"

namespace kilotwin {

/// Everything that makes a run. Resolved and checked by the host; what only the engine can find
/// throws EngineError.
struct SimulationDef {
    struct Group {
        std::string program;  ///< path of the guest, or of the .hex or .elf for a board
        std::string name;
        size_t count = 0;
        std::vector<Pose> poses;  ///< empty: placed at random
        bool on_board = false;    ///< each robot is an ATmega328P; with the Kilobot medium only
    };
    /// A message from outside the medium, to all robots with a uid in the range.
    struct Command {
        int64_t tick;  ///< since RUN; negative: before
        uint16_t uid_first, uid_last;
        message_t message;
        /// Only robots whose centre is in here when it is sent; infinite: everywhere.
        Eigen::Vector2d centre{0, 0};
        double radius_m = INFINITY;
    };

    uint64_t seed = 0;
    uint32_t step_ticks = 2;  ///< 1, 2 or 4
    Arena arena;
    Profile profile;
    SolverKind solver = SolverKind::DISCS;
    std::optional<VirtualFloor::Settings> floor;
    double range_m = 0.8;  ///< of the ideal medium
    bool line_of_sight = true;
    std::optional<KilobotMedium::Settings> kilobot_medium;  ///< instead of the ideal one
    std::optional<Grid::Settings> grid;                     ///< a Kilogrid below the robots
    int64_t lead_ticks = 0;  ///< engine time before RUN, for the grid's host; rounded up to 4
    Light light;
    double battery_h = 0;       ///< hours of driving that a full battery lasts; 0: it never drains
    int16_t temperature = 300;  ///< reading
    double clock_spread = 0;    ///< sd of the robots' oscillators, share
    double sensitivity_spread = 0;  ///< sd of the robots' receivers, share
    std::vector<Group> groups;
    std::vector<Command> commands;
    uint32_t sample_ticks = 305;  ///< at least step_ticks; taken when the world step is over
    std::string black_box;        ///< path of a file to map, or empty
    bool run_ahead = true;        ///< false: tick by tick, for tests
};

struct Statistics {
    uint64_t steps = 0;
    MediumCounts medium;
    uint64_t solver_steps = 0;  ///< bodies times steps
    uint64_t list_rebuilds = 0;
    Overlaps overlaps;
};

class Simulation {
  public:
    explicit Simulation(const SimulationDef &def);
    ~Simulation();

    /// Goes on by at least `ticks`, to the end of a world step.
    void advance(int64_t ticks);

    /// Nominal ticks since RUN, which happens at 0.
    int64_t tick() const;

    /// Queues a frame at the host's node of a bus now; false if its queue is full. EngineError
    /// without a grid, or such a bus.
    bool send_can(uint32_t bus, const CanFrame &frame);
    /// EngineError without one.
    Grid &grid();
    const Grid &grid() const;
    Cycles now() const { return now_; }
    /// Since t = 0, when the experiment begins.
    double seconds_of(Cycles at) const {
        return static_cast<double>(static_cast<int64_t>(at - run_at_)) * CYCLE_S;
    }

    /// Gives robots a message now, from outside the medium. `command.tick` does not matter.
    void send(const SimulationDef::Command &command);

    size_t size() const { return robots_.size(); }
    const Robot &robot(size_t index) const { return robots_[index]; }
    const Boards &boards() const { return boards_; }

    /// Lets gdb control a robot on a board: nothing goes on until it says so. `port` on 127.0.0.1.
    void serve_debugger(size_t robot, uint16_t port);

    /// Writes what the pins of a robot on a board do from now on to a VCD file.
    void trace(size_t robot, const std::string &path);
    Samples take_samples();
    Samples snapshot() const;
    Events take_events();
    Statistics statistics() const;

    /// Frames of each robot; empty with the ideal medium.
    std::vector<FrameCounts> frames() const;

    /// Nominal ticks since RUN of a moment.
    int64_t tick_of(Cycles at) const;

  private:
    /// What the floor said to a robot when it last looked around, and how long that holds.
    struct Surroundings {
        Cycles look_again = 0;       ///< until then nothing in it can change
        Cycles unchanged_until = 0;  ///< nothing changes before, whoever begins to move
        wire_cell_t cell = {0, 0};
    };
    /// What a robot sends: half a line of the cache.
    struct alignas(32) Sender {
        Cycles next_ask = 0;         ///< the earliest begin of a frame after those that are planned
        Cycles audience_at = NEVER;  ///< when the audience kept was found; NEVER: it does not hold
        CheckedMessage said;         ///< last
        uint8_t planned = 0;         ///< so many of its frames are in frames_
    };
    static_assert(sizeof(Sender) == sizeof(CacheLine) / 2);

    void create_robots();
    RobotBoard &board_of(size_t robot);
    void prepare_boards();
    Calibration calibrate(uint32_t robot) const;
    void boot();
    void step(Cycles limit);
    void give_commands(Cycles until);
    void give(const SimulationDef::Command &command, Cycles at);
    Cycles command_time(const SimulationDef::Command &command) const;
    void refresh_lists();
    void prefetch_due_after(size_t i) const;
    void live_on(uint32_t robot, Cycles limit);
    bool light_changes() const { return !def_.light.sources.empty(); }
    /// Not where light depends on the place: nobody knows for how long a robot will stay where it is.
    bool may_run_ahead() const { return def_.run_ahead && !light_changes(); }
    Cycles undisturbed_until(uint32_t robot, Cycles limit);
    void look_around(uint32_t robot);
    void disturb(uint32_t robot, Cycles at);
    void run_robot(uint32_t robot, Cycles until);
    void has_lived(uint32_t robot, Cycles until);
    void take_commands(uint32_t robot);
    void plan_frames(uint32_t robot);
    void look_around_grid();
    void run_grid();
    void deliver_to_grid(const Emission &emission);
    void prefetch_heard_after(const std::vector<PlannedFrame> &frames, size_t i) const;
    void deliver_frames();
    void deliver(const Emission &emission);
    const std::vector<Listener> &audience_of(uint32_t robot);
    bool audience_holds(uint32_t robot);
    void sample_if_due();
    void sample_into(Samples &samples) const;

    SimulationDef def_;
    Chance chance_;
    Cycles step_;               ///< length of a world step
    Cycles run_at_;             ///< when RUN is given: t = 0
    Cycles start_;              ///< when stepping begins: before, robots wait for commands
    Cycles now_;                ///< begin of the current step
    uint64_t samples_due_ = 0;  ///< so many were taken
    Cycles next_sample_;
    double reach_m_;  ///< nobody is heard from farther away
    Events events_;
    std::vector<Emission> emissions_;
    BlackBox *black_box_ = nullptr;
    RobotContext context_;
    std::vector<Swarm<CacheLine>> images_;  ///< state of all robots of a group
    Swarm<Robot> robots_;
    Boards boards_;
    std::vector<SimulationDef::Command> commands_;  ///< in order of time
    size_t next_command_ = 0;

    std::vector<uint32_t> due_;  ///< those to be seen to in this step

    // By robot.
    std::vector<Cycles> wake_;    ///< the begin of the step in which it next has to be seen to
    std::vector<Cycles> speaks_;  ///< the earliest moment at which it may begin a frame
    Swarm<Sender> senders_;       ///< of the ideal medium
    std::vector<Surroundings> surroundings_;

    std::optional<Bodies> bodies_;
    IdealMedium medium_;
    PlannedFrames frames_;  ///< of the ideal medium
    StepSorter<PlannedFrame> frame_sorter_;
    std::optional<Grid> grid_;
    std::optional<KilobotMedium> kilobot_medium_;
    std::optional<VirtualFloor> floor_;
    Cycles next_sensing_ = NEVER;   ///< of the floor, from now_ on
    Cycles later_sensing_ = NEVER;  ///< of the floor, after now_
    Samples samples_;
    uint64_t steps_ = 0;
    MediumCounts counts_;
};

}  // namespace kilotwin

#endif
