/// Where the robots are: in closed form while nothing touches them, by the solver near a contact.
///
/// All are placed when a step ends, one after the other: that costs less than to see to it whenever
/// somebody asks for a place. What motors were told, and what changes by itself, acts exactly at
/// its time.
#ifndef KILOTWIN_PHYSICS_BODIES_H
#define KILOTWIN_PHYSICS_BODIES_H

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "base/chance.h"
#include "base/clock.h"
#include "base/memory.h"
#include "base/motor_command.h"
#include "base/prefetch.h"
#include "base/selection.h"
#include "physics/arena.h"
#include "physics/chassis.h"
#include "physics/motion.h"
#include "physics/neighbours.h"
#include "physics/overlaps.h"
#include "physics/world.h"

namespace kilotwin {

class Bodies {
  public:
    /// Robots that stand at `poses` when the first step begins, at `begin`; steps last `step`.
    /// Lists of neighbours reach `reach_m` at least.
    Bodies(const Arena &arena, const Profile &profile, const Chance &chance, Cycles step,
           Cycles begin, const std::vector<Pose> &poses, double reach_m, SolverKind solver);

    /// What a robot's motors are told, in order of time, not before the current step.
    void command(uint32_t robot, const MotorCommand &command);

    /// To be called when a step begins: makes the lists of neighbours anew if that is due, and says
    /// so.
    bool refresh_lists();

    /// Goes to the end of the current step.
    void step();

    /// Brings into the cache what it takes to command a robot's motors.
    void prefetch(uint32_t robot) const {
        prefetch_line(&trajectories_[robot]);
        prefetch_line(&orders_[robot]);
        chassis_.prefetch(robot);
    }

    /// And where it is.
    void prefetch_place(uint32_t robot) const { prefetch_line(&places_[robot]); }

    size_t size() const { return places_.size(); }

    // What follows is said of the begin of the current step.

    /// Centre of a robot, m.
    const Eigen::Vector2d &position(uint32_t robot) const { return places_[robot]; }

    /// Those of all robots.
    const std::vector<Eigen::Vector2d> &positions() const { return places_; }

    Pose pose(uint32_t robot) const { return trajectories_[robot].pose(now_); }

    /// Unit vector of its heading.
    Eigen::Vector2d ahead(uint32_t robot) const { return trajectories_[robot].ahead(now_); }

    /// Whether it stays as it is, as far as is known: its motors are off, and nobody is at it.
    bool rests(uint32_t robot) const {
        return next_change_[robot] == NEVER && trajectories_[robot].drive().at_rest() &&
               !world_.holds(robot);
    }

    /// Since when it has stood in its place, at the earliest; NEVER while it moves.
    Cycles still_since(uint32_t robot) const { return still_since_[robot]; }

    /// Those that the solver moved or turned in the last step.
    const std::vector<uint32_t> &pushed() const { return pushed_; }

    /// Who is near whom.
    const Neighbours &lists() const { return lists_; }

    /// Before this, nobody comes within reach who is on no list.
    Cycles lists_hold_until() const { return lists_hold_until_; }
    uint64_t list_rebuilds() const { return list_rebuilds_; }

    /// Nobody moves faster, driven or pushed.
    double fastest_m_s() const { return fastest_m_s_; }

    uint64_t solver_steps() const { return solver_steps_; }  ///< bodies times steps
    const Overlaps &overlaps() const { return overlaps_; }

  private:
    /// Where a robot would go within a step, were it alone.
    struct alignas(64) FreeShift {
        Shift shift;
        double heading = 0;        ///< when the step begins
        Cycles at = NEVER;         ///< the begin of the step
        uint32_t before_slot = 0;  ///< in before_, if it is there
        uint32_t near_slot = 0;    ///< in near_, if it is in the solver
    };

    /// What a robot was told that has not taken effect yet.
    struct alignas(64) Orders {
        Few<MotorCommand, 2> list;
        size_t next = 0;
    };

    /// Those who may come into contact with a robot before `until`.
    using Others = Few<uint32_t, 8>;
    struct alignas(64) Around {
        Cycles until = 0;
        Others robots;
    };
    struct Pair {
        uint32_t one, other;
        double distance_m;  ///< of their centres, when the step begins
        auto operator<=>(const Pair &) const = default;
    };
    /// How a robot moved when the step began, whose drive changes within it.
    struct Before {
        uint32_t robot;
        Trajectory trajectory;
    };

    void place_all();

    /// Lets motor commands before `until`, and what changes by itself, take effect at their times.
    void apply_commands(uint32_t robot, Cycles until);
    /// All who may touch a robot within this step, and some more.
    const Others &around(uint32_t robot) {
        if (around_[robot].until <= now_) look_around(robot);
        return around_[robot].robots;
    }
    void look_around(uint32_t robot);
    const Trajectory &trajectory_before(uint32_t robot) const;
    /// Where a robot would go within this step, were it alone.
    FreeShift &free_shift(uint32_t robot) {
        FreeShift &free = shifts_[robot];
        if (free.at != now_) find_free_shift(robot, free);
        return free;
    }
    const Eigen::Vector2d &free_way(uint32_t robot) { return free_shift(robot).shift.by; }
    void find_free_shift(uint32_t robot, FreeShift &free);
    /// Robots whose centres are farther apart cannot touch within a step.
    double contact_reach_m() const { return 2 * radius_m_ + contact_gap_m_; }
    void prefetch_near_after(size_t i) const;
    void find_contacts();
    bool may_touch(uint32_t robot);
    double longest_free_m(uint32_t robot) const;
    bool meets(uint32_t robot, uint32_t other);
    bool meets_wall(uint32_t robot);
    void include(uint32_t robot) {
        if (!in_contact_[robot]) add_contact(robot);
    }
    void add_contact(uint32_t robot);
    void close_over(uint32_t robot);
    void hand_over();
    void solve_contacts();
    void find_company();
    void find_walls(Near &near) const;
    void record_overlap(double gap_m);

    const Arena &arena_;
    double radius_m_, margin_m_;
    Cycles step_;
    Cycles now_;  ///< begin of the current step
    Chassis chassis_;
    double fastest_m_s_;
    double contact_gap_m_;  ///< robots farther apart cannot touch within a step
    Cycles unlisted_for_;   ///< so long after lists end to hold, who is on none cannot touch either
    World world_;
    Neighbours lists_;
    std::vector<Eigen::Vector2d> listed_at_;  ///< positions when the lists were made
    Cycles lists_due_;                        ///< for a look whether they are still good
    Cycles lists_hold_until_;
    uint64_t list_rebuilds_ = 0;

    // By robot.
    Swarm<Trajectory> trajectories_;
    std::vector<Eigen::Vector2d> places_;  ///< when the current step begins
    std::vector<Cycles> next_change_;      ///< of its drive
    std::vector<double> speeds_;           ///< of its drive, m/s
    std::vector<Cycles> still_since_;      ///< NEVER while it moves
    std::vector<uint8_t> steps_apart_;     ///< of one in the solver
    std::vector<uint8_t> in_contact_;      ///< whether it is in contacts_
    std::vector<Cycles> next_contact_;     ///< before this, nothing is near enough to touch
    Swarm<Orders> orders_;
    Swarm<Around> around_;
    Swarm<FreeShift> shifts_;

    std::vector<uint32_t> changing_;        ///< whose drive changes within a step
    std::vector<uint32_t> near_something_;  ///< who may come upon something within this step
    std::vector<uint32_t> contacts_;  ///< robots that belong into the solver this step, ascending
    std::vector<Before> before_;
    std::vector<Pair> pairs_;  ///< of robots in the solver that may touch this step
    std::vector<uint32_t> pushed_;
    std::vector<Near> near_;               ///< of the robots in the solver
    std::vector<Crowd::Pair> near_pairs_;  ///< of near_
    double longest_shift_m_ = 0;  ///< of a robot in the solver, in the last step or this one
    uint64_t solver_steps_ = 0;
    Overlaps overlaps_;
};

}  // namespace kilotwin

#endif
