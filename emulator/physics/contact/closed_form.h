/// A contact of two bodies in closed form: two robots that meet, or one robot at a wall, with
/// nothing else in reach. Along the contact's normal they stay together from the moment they touch
/// (an inelastic collision); across it Coulomb friction acts.
///
/// Replaces a solver's iterations by one formula where a contact has no second one beside it: most
/// contacts of a sparse swarm. test_contacts compares with Box2D.
#ifndef KILOTWIN_PHYSICS_CONTACT_CLOSED_FORM_H
#define KILOTWIN_PHYSICS_CONTACT_CLOSED_FORM_H

#include <Eigen/Core>

#include "physics/contact/mechanics.h"

namespace kilotwin {

/// One side of a contact: its velocity, changed in place, and its displacement in this step, which
/// is overwritten.
struct ContactSide {
    DrivenBody &body;
    Shift &moved;
};

struct ClosedForm {
    Mechanics mechanics;

    /// Moves `robot`, and `other` unless it is null, for `time_s`. Null stands for what cannot
    /// move: a wall, or a robot that does not give way. `normal` is the unit vector from `robot`
    /// to the other side, `gap_m` the distance of their rims; below 0 they overlap, and separate at
    /// no more than mechanics.part_m_s. Constant time; no allocation.
    void step(const ContactSide &robot, const ContactSide *other, const Eigen::Vector2d &normal,
              double gap_m, double time_s) const;

  private:
    void push(Shift &velocity, const Eigen::Vector2d &impulse, double tangential) const;
};

}  // namespace kilotwin

#endif
