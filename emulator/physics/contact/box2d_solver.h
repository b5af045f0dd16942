/// A contact solver that hands islands to Box2D 3. Independent of disc_solver.h, and its oracle in
/// test_contacts; takes about twice as many instructions. `engine.contact_solver = "box2d"` chooses
/// it.
///
/// The only file that knows Box2D's types is box2d_solver.cpp. One robot radius is 0.1 of its
/// length units in every profile, because its tolerances are fixed in units: it finds a contact
/// that is 0.18 radii away. Each robot has a body of its own, created when it first comes into
/// contact and disabled while it is in no island.
#ifndef KILOTWIN_PHYSICS_CONTACT_BOX2D_SOLVER_H
#define KILOTWIN_PHYSICS_CONTACT_BOX2D_SOLVER_H

#include <memory>
#include <string>

#include "physics/arena.h"
#include "physics/contact/contact_solver.h"

namespace kilotwin {

class Box2DSolver final : public ContactSolver {
  public:
    /// `robots`: their number; `arena` is read here only. A round wall has 720 straight segments.
    Box2DSolver(const Arena &arena, const Mechanics &mechanics, size_t robots);
    ~Box2DSolver() override;

    /// 16 sub-steps a tick, and more steps a tick where robots are faster than the margin allows.
    void solve(Islands &islands, double step_s) override;

  private:
    struct Box2D;
    std::unique_ptr<Box2D> box2d_;
    const Mechanics mechanics_;
};

/// Version of the Box2D library linked, "3.1.1".
std::string box2d_version();

}  // namespace kilotwin

#endif
