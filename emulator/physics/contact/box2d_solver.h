/// The contact solver: hands islands (islands.h) to Box2D 3, all of a step in one Box2D step.
///
/// The only file that knows Box2D's types is box2d_solver.cpp. One robot radius is 0.1 of its
/// length units in every profile, because its tolerances are fixed in units: it finds a contact
/// that is 0.18 radii away. Each robot has a body of its own, created when it first comes into
/// contact and disabled while it is in no island. Box2D has room for 128 worlds in a process, so a
/// solver takes one only when it first has something to solve.
#ifndef KILOTWIN_PHYSICS_CONTACT_BOX2D_SOLVER_H
#define KILOTWIN_PHYSICS_CONTACT_BOX2D_SOLVER_H

#include <memory>
#include <string>

#include "physics/arena.h"
#include "physics/contact/islands.h"

namespace kilotwin {

class Box2DSolver {
  public:
    /// ORACLE is for tests: many times slower, and as exact as Box2D can be.
    enum class Accuracy : uint8_t { NORMAL, ORACLE };

    /// `robots`: their number; `objects` are read here only, `arena` must live on. A round wall has
    /// 720 straight segments. EngineError if an object has a part that is too thin, or of objects
    /// as solve().
    Box2DSolver(const Arena &arena, const Mechanics &mechanics, size_t robots,
                const std::vector<Object> &objects, Accuracy accuracy);
    ~Box2DSolver();

    /// Moves all bodies for `step_s`, a whole number of ticks: sets `moved` and the velocities.
    /// To be called once a world step, also without bodies: what is known of a body is kept as long
    /// as that body is in each call. Equal input, in equal order, gives equal bits.
    ///
    /// NORMAL: one Box2D step for all islands, of 1.25 sub-steps a tick, and up to 3 when robots
    /// that overlap do so by more than 0.4 % of a diameter on average, or may touch an object;
    /// several steps where they would close by more than Box2D looks ahead.
    /// ORACLE: as the drives' law is written, tick by tick, 16 sub-steps each.
    /// EngineError if Box2D has no world left for the first bodies.
    void solve(Islands &islands, double step_s);

    /// Drops what is known of a robot that is elsewhere now.
    void forget(uint32_t robot);

  private:
    bool is_open() const;  ///< has its Box2D world
    void open(const std::vector<Object> &objects);
    void step_once(Islands &islands, double step_s);
    void step_by_ticks(Islands &islands, double step_s);
    struct Gaps {
        double overlap_m = 0;  ///< mean of those that overlap, as the step begins
        double closing_m = 0;  ///< farthest that robots close in it where Box2D does not look
    };
    Gaps find_gaps(const Islands &islands, double step_s) const;
    void keep_off_walls(Islands::Body &body) const;
    int rounds_of(double closing_m) const;

    struct Box2D;
    std::unique_ptr<Box2D> box2d_;
    const Arena &arena_;
    const Mechanics mechanics_;
    const Accuracy accuracy_;
};

/// Version of the Box2D library linked, "3.1.1".
std::string box2d_version();

}  // namespace kilotwin

#endif
