/// Poses of all robots, and the broad phase: in closed form while nothing touches a robot
/// (motion.h), by Contacts while it is near a contact.
///
/// A world step is: command() for what motors were ordered within it, then step(). That finds where
/// all robots would be at its end if nothing touched them, whether anything asks or not: it costs
/// less than keeping track of which places are old. Then it moves those that touch something. Motor
/// commands and motor noise act exactly at their times within a step. Members of a team share the
/// robots, and command() those of their shares.
///
/// Neighbour lists (neighbours.h) hold all robots within a reach, plus a skin. They are renewed
/// when a robot has moved by a share of half the skin, so that no robot outside a list comes within
/// reach before lists_hold_until().
#ifndef KILOTWIN_PHYSICS_BODIES_H
#define KILOTWIN_PHYSICS_BODIES_H

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "base/chance.h"
#include "base/clock.h"
#include "base/few.h"
#include "base/memory.h"
#include "base/motor_command.h"
#include "base/prefetch.h"
#include "base/selection.h"
#include "base/slots.h"
#include "base/team.h"
#include "physics/arena.h"
#include "physics/chassis.h"
#include "physics/contact/contacts.h"
#include "physics/motion.h"
#include "physics/neighbours.h"
#include "physics/objects.h"
#include "physics/overlaps.h"

namespace kilotwin {

class Bodies {
  public:
    /// Robots that stand at `poses`, by slot, when the first step begins, at `begin`; steps last
    /// `step` cycles, 1, 2 or 4 ticks. Neighbour lists reach `reach_m` at least, and never less
    /// than a contact does. `arena`, `chance`, `slots` and `team` must outlive this.
    Bodies(const Arena &arena, const Profile &profile, const Chance &chance, const Slots &slots,
           Team &team, Cycles step, Cycles begin, const std::vector<Pose> &poses, double reach_m,
           const std::vector<PlacedObject> &objects = {});

    /// Orders duties of a robot's motors from `command.at` on. Calls come in order of time for each
    /// robot; a time before the current step acts at its begin.
    void command(uint32_t robot, const MotorCommand &command);

    /// Takes back what was ordered of a robot from `from` on, a time not before the current step.
    void take_back_commands(uint32_t robot, Cycles from);

    /// Whether a robot could stand at a point: clear of walls, objects and all other robots.
    /// O(robots).
    bool has_room(uint32_t robot, const Eigen::Vector2d &point) const;

    /// Takes a robot away to `pose`, where it has room, when the current step begins and before
    /// refresh_lists(). Its motors stay as they are ordered. O(robots).
    void place(uint32_t robot, const Pose &pose);

    /// To be called when a step begins: renews the neighbour lists if that is due. Returns whether
    /// it did. Mostly a comparison; a renewal takes O(robots + pairs).
    bool refresh_lists();

    /// Goes to the end of the current step. O(robots).
    void step();

    /// Multiplies the speeds of a robot's motors for good, from now on.
    void scale_motors(uint32_t robot, double left, double right);

    /// Prefetches what command() needs of a robot.
    void prefetch(uint32_t robot) const {
        prefetch_object(trajectories_[robot]);
        prefetch_line(&commands_[robot]);
        prefetch_line(&next_change_[robot]);
    }

    /// Prefetches what position() needs.
    void prefetch_place(uint32_t robot) const { prefetch_line(&places_[robot]); }

    /// Walls, obstacles and sites.
    const Arena &arena() const { return arena_; }

    /// The number of robots.
    size_t size() const { return places_.size(); }

    // State when the current step begins.

    /// Centre of a robot, m. A load from an array.
    const Eigen::Vector2d &position(uint32_t robot) const { return places_[robot]; }

    /// Centres of all robots, by index.
    const Swarm<Eigen::Vector2d> &positions() const { return places_; }

    /// Position and heading. Evaluates the trajectory.
    Pose pose(uint32_t robot) const { return trajectories_[robot].pose(now_); }

    /// Unit vector of a robot's heading.
    Eigen::Vector2d ahead(uint32_t robot) const { return trajectories_[robot].ahead(now_); }

    /// Whether a robot stays as it is unless it is commanded: its motors are off, and it is near no
    /// contact.
    bool rests(uint32_t robot) const {
        return next_change_[robot] == NEVER && trajectories_[robot].drive().at_rest() &&
               !is_held_[robot];
    }

    /// The earliest moment since which a robot's centre has stood still; NEVER while it moves.
    Cycles still_since(uint32_t robot) const { return still_since_[robot]; }

    /// Seconds that a robot's motors were on so far while neither turned.
    double hummed_s(uint32_t robot) const { return chassis_.hummed_s(robot, now_); }

    /// The pose of an object, in the frame of its definition.
    Pose object_pose(uint32_t object) const {
        return objects_[object].frame_of(object_states_[object].pose);
    }
    size_t objects() const { return objects_.size(); }  ///< how many there are

    /// Robots that Contacts moved or turned in the last step, ascending.
    const std::vector<uint32_t> &pushed() const { return pushed_; }

    /// Neighbour lists.
    const Neighbours &lists() const { return lists_; }

    /// Before this moment no robot comes within reach of another that is not in its list.
    Cycles lists_hold_until() const { return lists_hold_until_; }
    /// How often refresh_lists() has renewed them.
    uint64_t list_rebuilds() const { return list_rebuilds_; }

    /// Limit of every robot's speed, driven or pushed, m/s.
    double fastest_m_s() const { return fastest_m_s_; }

    uint64_t solver_steps() const { return solver_steps_; }  ///< robots near a contact, times steps
    /// Those of them that the contact solver moved: robots in islands.
    uint64_t island_steps() const { return contacts_.island_steps(); }
    /// Overlaps of all contacts of all steps so far.
    Overlaps overlaps() const;

  private:
    /// Two robots that may touch within the step.
    struct Pair {
        uint32_t one, other;
        double distance_m;  ///< of their centres, when the step begins
        auto operator<=>(const Pair &) const = default;
    };
    /// A robot that is near a contact.
    struct Held {
        static constexpr uint32_t NEW = UINT32_MAX;
        uint32_t robot;
        uint32_t last_number;  ///< position in crowd_ in the last step; NEW: it had none
    };
    /// Robots of a share, ascending, in a step (base/team.h).
    struct alignas(64) Share {
        std::vector<uint32_t> changing;      ///< their drive changes
        std::vector<uint32_t> near_contact;  ///< to be examined by the broad phase
        std::vector<uint32_t> touching;      ///< those that may touch something
        std::vector<Pair> pairs;   ///< two that both touch, the first of this share; ascending
        std::vector<Pair> asides;  ///< `one` touches; as far as is known, `other` does not
        std::vector<Held> held;
        std::vector<Held> held_so_far;  ///< in the last step
        std::vector<uint32_t> pushed;   ///< robots held that were pushed
        double drift_square = 0;        ///< the longest since the lists were made, squared
        double shift_square = 0;        ///< the longest in this step of those near a contact
        Overlaps overlaps;              ///< so far
    };

    /// Motor commands that have not taken effect: list[next] and later.
    struct alignas(64) Commands {
        Few<MotorCommand, 2> list;
        size_t next = 0;
    };

    using RobotList = Few<uint32_t, 8>;
    /// Robots that may come into contact with one before `until`.
    struct alignas(64) Candidates {
        Cycles until = 0;
        RobotList robots;
        // Places of the one robot in lists of a step, if it is there.
        uint32_t before_number = 0;  ///< position in before_
        uint32_t body_number = 0;    ///< position in crowd_
    };
    /// The robots around an object when a list of them was made.
    struct Surroundings {
        std::vector<uint32_t> robots;  ///< ascending
        Eigen::Vector2d from{0, 0};    ///< where the object was
        Cycles made_at = NEVER;
    };
    /// How a robot goes when the step begins.
    struct Going {
        double heading;
        Drive drive;
    };
    /// That of a robot whose drive changes within the step.
    struct Before {
        uint32_t robot;
        Going going;
    };

    /// Brings into the cache what apply_commands() needs of a robot.
    void prefetch_motors(uint32_t robot) const {
        prefetch(robot);
        chassis_.prefetch(robot);
    }
    void go_freely();
    void change_drives(const Share &share, size_t number);
    void apply_commands(uint32_t robot, Cycles until);
    bool has_changed(uint32_t robot) const;
    Going going(uint32_t robot) const;
    /// Its way within this step if nothing touched it.
    Eigen::Vector2d free_path(uint32_t robot) const { return next_places_[robot] - places_[robot]; }
    /// Whether it stays where it is in this step unless something touches it.
    bool stays(uint32_t robot) const {
        return trajectories_[robot].drive().at_rest() && next_change_[robot] >= now_ + step_ &&
               !has_changed(robot);
    }
    double longest_free_m(uint32_t robot) const;

    // The broad phase: from all robots to those that touch, and their pairs. Most robots cost a
    // comparison with next_contact_ only.
    const RobotList &candidates(uint32_t robot) {
        if (candidates_[robot].until <= now_) find_candidates(robot);
        return candidates_[robot].robots;
    }
    void find_candidates(uint32_t robot);
    /// Robots whose centres are farther apart cannot touch within a step.
    double contact_reach_m() const { return 2 * radius_m_ + contact_gap_m_; }
    void prefetch_near_after(const Share &share, size_t i) const;
    void prefetch_touching_after(const Share &share, size_t i) const;
    void prefetch_held_after(const Share &share, size_t i) const;
    void find_contacts();
    void find_touching(Share &share, size_t begin, size_t end);
    bool may_touch(uint32_t robot);
    bool would_touch(uint32_t robot, uint32_t other) const;
    bool would_touch_wall(uint32_t robot, double wall_gap_m) const;
    void find_touched(Share &share);
    void include(uint32_t robot) {
        if (!is_touching_[robot]) add_touching(robot);
    }
    void add_touching(uint32_t robot);
    void add_all_touched();
    void add_touched(const Pair &pair);
    template <typename Visit> void for_each_touched(uint32_t robot, Visit visit);

    // Objects take part when they move, or when a robot or an object that takes part is near: a
    // step costs a look at each robot around each object, and now and then at all robots.
    void find_near_objects();
    const std::vector<uint32_t> &robots_around(uint32_t object);
    bool include_objects();
    bool is_pushed(uint32_t object) const;
    bool are_near(uint32_t object, uint32_t other) const;
    void take_pushed_objects();
    bool has_stopped(uint32_t object) const;
    bool is_near_pushed(uint32_t object) const;

    // After it: robots that touch to contacts_, and their poses back.
    void update_contacts();
    void hold_touching(Share &share, uint32_t last_number);
    void step_contacts();
    void fill_bodies(const Share &share, uint32_t number);
    void fill_body(ContactBody &body, uint32_t robot, double heading);
    /// A body goes on from where the contact left it.
    void take_moved(ContactBody &body, Cycles end);
    void take_all_moved(Share &share, const Crowd::Share &crowd);
    void find_body_pairs(const Share &share, Crowd::Share &crowd) const;
    void find_wall_contacts(ContactBody &body) const;
    void record_overlap(Share &share, double gap_m) const;  ///< if it is negative

    const Arena &arena_;
    Team &team_;
    double radius_m_, margin_m_;
    Cycles step_;  ///< length of a world step
    Cycles now_;   ///< begin of the current step
    Chassis chassis_;
    double fastest_m_s_;
    double contact_gap_m_;  ///< robots farther apart, from rim to rim, cannot touch within a step
    Cycles unlisted_for_;   ///< after lists cease to hold, no unlisted robot can touch for so long
    std::vector<Object> objects_;
    Contacts contacts_;
    Neighbours lists_;
    Swarm<Eigen::Vector2d> listed_at_;  ///< positions when the lists were made
    Cycles lists_due_;                  ///< when to check the next time whether they hold
    bool lists_stale_ = false;          ///< whatever robots' ways were: one was placed
    Cycles lists_hold_until_;
    uint64_t list_rebuilds_ = 0;  ///< so far

    // By robot. Records that one loop needs together share a cache line.
    Swarm<Trajectory> trajectories_;
    Swarm<Eigen::Vector2d> places_;  ///< when the current step begins
    /// When it ends: if nothing touched it, then where that left it.
    Swarm<Eigen::Vector2d> next_places_;
    Swarm<Cycles> next_change_;         ///< of its drive
    Swarm<double> speeds_;              ///< of its drive, m/s
    Swarm<Cycles> still_since_;         ///< NEVER while it moves
    std::vector<uint8_t> is_held_;      ///< whether it is near a contact, or was: see crowd_
    std::vector<uint8_t> steps_apart_;  ///< steps since a robot that is held touched
    std::vector<uint8_t> is_touching_;  ///< whether it may touch something in this step
    Swarm<Cycles> next_contact_;        ///< before this, nothing is near enough to touch
    Swarm<Commands> commands_;          ///< by robot, those of this step and later
    Swarm<Candidates> candidates_;

    // By object.
    std::vector<ObjectState> object_states_;
    std::vector<Surroundings> surroundings_;
    std::vector<uint8_t> is_pushed_;                   ///< takes part in this step
    std::vector<uint8_t> is_stopped_;                  ///< scratch of take_pushed_objects()
    std::vector<std::vector<uint32_t>> near_objects_;  ///< robots that may touch it in this step

    // Lists of one step; kept for their memory.
    std::vector<Share> shares_;
    std::vector<Before> before_;   ///< robots whose drive changes, ascending; and old ones
    size_t changing_ = 0;          ///< the number of those
    std::vector<uint32_t> added_;  ///< robots that touch since another does, as they were found
    size_t next_added_ = 0;        ///< the next of them whose neighbours are looked at
    std::vector<uint32_t> pushed_;
    Crowd crowd_;                            ///< the robots held
    std::vector<DrivenBody> driven_so_far_;  ///< those of crowd_ of the last step
    std::vector<Islands::PushedObject> pushed_objects_;
    std::vector<uint8_t> at_object_;  ///< by robot: whether it may touch an object that takes part
    double longest_shift_m_ = 0;      ///< a held robot's, in the last step or this one
    uint64_t solver_steps_ = 0;
};

}  // namespace kilotwin

#endif
