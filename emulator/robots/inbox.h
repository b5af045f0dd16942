/// Inboxes: receptions that wait for their time, in order of time. Few wait at once, so a sorted
/// list does.
#ifndef KILOTWIN_ROBOTS_INBOX_H
#define KILOTWIN_ROBOTS_INBOX_H

#include <algorithm>

namespace kilotwin {

/// Puts a reception behind those that are not later: of equal times the first in is the first out.
/// Mostly it goes to the end.
template <typename Inbox>
void insert_by_time(Inbox &inbox, const typename Inbox::value_type &reception) {
    auto later = [](const auto &a, const auto &b) { return a.at < b.at; };
    inbox.insert(std::upper_bound(inbox.begin(), inbox.end(), reception, later), reception);
}

}  // namespace kilotwin

#endif
