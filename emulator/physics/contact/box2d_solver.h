/// Box2D: slower than our own solver, and independent of it. Only box2d_solver.cpp knows its types.
///
/// One robot radius is 0.1 of its units in every profile, because its tolerances are fixed in
/// units: so it sees a contact coming that is 0.18 radii away.
#ifndef KILOTWIN_PHYSICS_CONTACT_BOX2D_SOLVER_H
#define KILOTWIN_PHYSICS_CONTACT_BOX2D_SOLVER_H

#include <memory>
#include <string>

#include "physics/arena.h"
#include "physics/contact/contact_solver.h"

namespace kilotwin {

class Box2DSolver final : public ContactSolver {
  public:
    Box2DSolver(const Arena &arena, const Mechanics &mechanics, size_t robots);
    ~Box2DSolver() override;

    void solve(Crowd &crowd, double step_s) override;

  private:
    struct Box2D;
    std::unique_ptr<Box2D> box2d_;
    const Mechanics mechanics_;
};

/// Version of the Box2D library linked, "3.1.1".
std::string box2d_version();

}  // namespace kilotwin

#endif
