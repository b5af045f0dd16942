/// Statistics of the penetration of bodies: how far the contact solver let them into one another.
#ifndef KILOTWIN_PHYSICS_OVERLAPS_H
#define KILOTWIN_PHYSICS_OVERLAPS_H

#include <array>
#include <cstdint>

namespace kilotwin {

/// Penetrations as fractions of a robot's diameter, over all contacts of all steps. Constant
/// memory: a histogram of 2001 classes of 0.0001, the last of which takes whatever is deeper.
class Overlaps {
  public:
    /// Counts one contact; `fraction` is 0 or more.
    void add(double fraction);
    /// Counts all that another has counted. The order of calls does not matter.
    void add(const Overlaps &other);

    /// How many were added.
    uint64_t contacts() const { return contacts_; }
    double worst() const { return worst_; }  ///< exact; 0 without contacts

    /// Upper edge of the class that holds the median; 0 without contacts. Costs a pass over the
    /// classes.
    double median() const;

  private:
    static constexpr double CLASS = 0.0001;
    std::array<uint64_t, 2001> classes_{};  ///< contacts by depth
    uint64_t contacts_ = 0;                 ///< all of them
    double worst_ = 0;                      ///< fraction of a diameter
};

}  // namespace kilotwin

#endif
