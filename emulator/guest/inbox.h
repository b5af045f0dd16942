/// Inboxes of a module: receptions that wait for their time, in order of time. Few wait at once.
#ifndef KILOTWIN_GUEST_INBOX_H
#define KILOTWIN_GUEST_INBOX_H

#include <algorithm>
#include <vector>

namespace kilotwin {

/// Puts a reception behind those that are not later. Mostly it goes to the end.
template <typename Reception>
void insert_by_time(std::vector<Reception> &inbox, const Reception &reception) {
    auto later = [](const Reception &a, const Reception &b) { return a.at < b.at; };
    inbox.insert(std::upper_bound(inbox.begin(), inbox.end(), reception, later), reception);
}

}  // namespace kilotwin

#endif
