#include "physics/overlaps.h"

#include <algorithm>

namespace kilotwin {

void Overlaps::add(double fraction) {
    contacts_++;
    worst_ = std::max(worst_, fraction);
    classes_[static_cast<size_t>(
        std::min(fraction / CLASS, static_cast<double>(classes_.size() - 1)))]++;
}

void Overlaps::add(const Overlaps &other) {
    contacts_ += other.contacts_;
    worst_ = std::max(worst_, other.worst_);
    for (size_t i = 0; i < classes_.size(); i++) classes_[i] += other.classes_[i];
}

double Overlaps::median() const {
    if (contacts_ == 0) return 0;
    uint64_t below = 0;
    size_t i = 0;
    while ((below += classes_[i]) * 2 < contacts_) i++;
    return static_cast<double>(i + 1) * CLASS;
}

}  // namespace kilotwin
