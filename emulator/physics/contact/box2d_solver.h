/// The solver of islands with objects, and of tests: hands islands (islands.h) to Box2D 3, all of a
/// step in one Box2D step.
///
/// The only file that knows Box2D's types is box2d_solver.cpp. One robot radius is 0.1 of its
/// length units in every profile, because its tolerances are fixed in units: it finds a contact
/// that is 0.18 radii away. Each robot has a body of its own, created when it first comes into
/// contact and disabled while it is in no island. Box2D has room for 128 worlds in a process.
#ifndef KILOTWIN_PHYSICS_CONTACT_BOX2D_SOLVER_H
#define KILOTWIN_PHYSICS_CONTACT_BOX2D_SOLVER_H

#include <memory>
#include <string>

#include "physics/contact/island_solver.h"

namespace kilotwin {

class Box2DSolver final : public IslandSolver {
  public:
    /// ORACLE is for tests: many times slower, and as exact as Box2D can be.
    enum class Accuracy : uint8_t { NORMAL, ORACLE };

    /// `robots`: their number; `objects` are read here only, `arena` must live on. A round wall has
    /// 720 straight segments. EngineError if an object has a part that is too thin, or if Box2D has
    /// no world left.
    Box2DSolver(const Arena &arena, const Mechanics &mechanics, size_t robots,
                const std::vector<Object> &objects, Accuracy accuracy);
    ~Box2DSolver() override;

    /// NORMAL: a Box2D step for each round, all islands at once (Division).
    /// ORACLE: as the drives' law is written, tick by tick, 16 sub-steps each.
    void solve(std::vector<Islands> &shares, double step_s) override;
    bool solves_by_shares() const override { return false; }
    void forget(uint32_t robot) override;

  private:
    void step_once(Islands &islands, double step_s);
    void step_by_ticks(Islands &islands, double step_s);
    double swept_m(const Islands &islands, double step_s) const;
    void keep_off_walls(Islands::Body &body) const;
    int rounds_of(double closing_m) const;

    struct Box2D;
    std::unique_ptr<Box2D> box2d_;
    const Accuracy accuracy_;
};

/// Version of the Box2D library linked, "3.1.1".
std::string box2d_version();

}  // namespace kilotwin

#endif
