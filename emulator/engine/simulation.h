/// One run: robots, their world, the medium and the floor, stepped together.
///
/// A world step (1, 2 or 4 ticks) goes: (1) robots that something may have reached look around, are
/// told what the floor says and run ahead to the earliest moment at which anything can reach them;
/// (2) frames that began within the step find their listeners, who hear them from the next step on;
/// (3) bodies move, in closed form or, near a contact, by the solver. What a robot is not woken for
/// cannot have happened: run-ahead changes the cost of a run, never its result.
#ifndef KILOTWIN_ENGINE_SIMULATION_H
#define KILOTWIN_ENGINE_SIMULATION_H

#include <cmath>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/arena.h"
#include "engine/chance.h"
#include "engine/chassis.h"
#include "engine/clock.h"
#include "engine/events.h"
#include "engine/ideal_medium.h"
#include "engine/kilobot_medium.h"
#include "engine/light.h"
#include "engine/motion.h"
#include "engine/neighbours.h"
#include "engine/recorder.h"
#include "engine/virtual_floor.h"
#include "engine/world.h"
#include "grid/grid.h"
#include "guest/robot.h"

namespace kilotwin {

/// Everything that makes a run. Resolved and checked by the host; what only the engine can find
/// throws EngineError.
struct SimulationDef {
    struct Group {
        std::string program;  ///< path of the guest
        std::string name;
        size_t count = 0;
        std::vector<Pose> poses;  ///< empty: placed at random
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
    bool can_send(uint32_t bus, const CanFrame &frame);
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
    Samples take_samples();
    Samples snapshot() const;
    Events take_events();
    const Statistics &statistics() const { return statistics_; }

    /// Nominal ticks since RUN of a moment.
    int64_t tick_of(Cycles at) const;

  private:
    /// What a robot's last look around found, and how long that holds.
    struct Surroundings {
        Cycles look_again = 0;           ///< until then nothing in it can change
        Cycles alone_until = 0;          ///< nobody comes into contact, sight or reach before
        std::vector<uint32_t> in_reach;  ///< who may be heard
        wire_cell_t cell = {0, 0};
        bool crowded = false;  ///< a body or wall is so near that this step may bring contact
    };

    void create_robots();
    Calibration calibrate(uint32_t robot) const;
    void boot();
    void step(Cycles limit);
    void give_commands(Cycles until);
    void give(const SimulationDef::Command &command, Cycles at);
    Cycles command_time(const SimulationDef::Command &command) const;
    Cycles begin_of_step(Cycles at) const;
    Cycles end_of_step(Cycles at) const;
    void refresh_lists();
    double lists_hold_for_s() const;
    void attend(uint32_t robot, Cycles limit);
    void look_around(uint32_t robot);
    Cycles silent_until(uint32_t robot) const;
    Cycles whole_steps(double for_s) const;
    void run_robot(uint32_t robot, Cycles until);
    void take_over_plans();
    void look_around_grid();
    void run_grid();
    void deliver_to_grid(const Emission &emission);
    void deliver_frames();
    bool audience_holds(uint32_t robot) const;
    void move();
    void place(uint32_t robot, const Eigen::Vector2d &position);
    bool moves_in_step(uint32_t robot) const;
    void find_contacts();
    void apply_commands(uint32_t robot, Trajectory &trajectory);
    void solve_contacts();
    void record_overlaps();
    void disturb_neighbours(uint32_t robot);
    void sample_if_due();
    void sample_into(Samples &samples) const;

    SimulationDef def_;
    Chance chance_;
    Cycles step_;    ///< length of a world step
    Cycles run_at_;  ///< when RUN is given: t = 0
    Cycles start_;   ///< when stepping begins: before, robots wait and hear commands only
    Chassis chassis_;
    Cycles now_ = 0;            ///< begin of the current step
    uint64_t samples_due_ = 0;  ///< so many were taken
    Cycles next_sample_;
    double reach_m_;        ///< nobody is heard from farther away
    double contact_gap_m_;  ///< robots farther apart cannot touch within a step
    Events events_;
    std::vector<Emission> emissions_;
    std::vector<Emission> on_air_;  ///< of the current step
    BlackBox *black_box_ = nullptr;
    RobotContext context_;
    std::vector<std::unique_ptr<uint8_t[]>> images_;  ///< state of all robots of a group
    std::deque<Robot> robots_;
    std::vector<SimulationDef::Command> commands_;  ///< in order of time
    size_t next_command_ = 0;

    // By robot.
    std::vector<Cycles> wake_;
    std::vector<Cycles> next_ask_;    ///< when it may next send, at the earliest
    std::vector<Cycles> next_motor_;  ///< of its pending motor commands
    std::vector<size_t> motor_index_;
    std::vector<Trajectory> trajectories_;
    std::vector<Eigen::Vector2d> positions_;  ///< at now_
    std::vector<Cycles> still_since_;         ///< NEVER while it moves
    std::vector<Cycles> audience_at_;         ///< when its audience was found
    std::vector<Surroundings> surroundings_;
    std::vector<uint8_t> steps_apart_;
    std::vector<bool> in_contact_;

    Neighbours neighbours_;
    std::vector<Eigen::Vector2d> listed_at_;  ///< positions when the lists were made
    double drift_m_ = 0;                      ///< nobody has moved farther since
    IdealMedium medium_;
    std::optional<Grid> grid_;
    std::optional<KilobotMedium> kilobot_medium_;
    std::vector<uint32_t> attended_;  ///< robots that run in this step
    std::vector<uint32_t> together_;  ///< those of them that the Kilobot medium runs
    std::optional<VirtualFloor> floor_;
    Cycles next_sensing_ = NEVER;  ///< of the floor, from now_ on
    World world_;
    std::vector<uint32_t> contacts_;  ///< robots that belong into the solver this step, ascending
    std::vector<uint32_t> leaving_;   ///< and those that no longer do
    std::vector<Pose> poses_before_;  ///< of the robots in the solver
    std::vector<Shift> free_shifts_;  ///< and where each would go within the step, were it alone
    uint32_t touching_steps_ = 0;
    Samples samples_;
    Statistics statistics_;
};

}  // namespace kilotwin

#endif
