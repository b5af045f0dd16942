/// A team: threads that share the work of a loop over robots.
///
/// Robots are cut into shares, as many as the team has members, each a block of indices: the same
/// blocks in every loop, so that a robot's memory stays with one member. A loop that shares its
/// work touches only what belongs to its share, and reads what no share changes meanwhile; what
/// shares make is put together afterwards, in the order of shares. So results depend neither on how
/// many members there are nor on who comes first.
#ifndef KILOTWIN_BASE_TEAM_H
#define KILOTWIN_BASE_TEAM_H

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <thread>
#include <vector>

namespace kilotwin {

/// A member waits in a short loop for the next work, then sleeps. One loop is shared at a time, by
/// the thread that made the team.
class Team {
  public:
    /// A team of one member, the caller alone.
    Team() : Team(1, nullptr) {}
    /// A team of `members`, 1 or more: the caller and threads that are started here. Each of these
    /// calls `prepare`, which may be null, before any of them has work. EngineError where the
    /// system starts no more threads.
    Team(uint32_t members, void (*prepare)());
    ~Team();
    Team(const Team &) = delete;
    Team &operator=(const Team &) = delete;

    /// How many members there are, and shares.
    uint32_t size() const { return size_; }

    /// Where a share of `count` items begins; that of size() is `count`.
    size_t begin_of(uint32_t share, size_t count) const { return count * share / size_; }

    /// The share that an item belongs to.
    uint32_t share_of(size_t item, size_t count) const {
        if (size_ == 1) return 0;
        auto share = static_cast<uint32_t>(item * size_ / count);
        while (begin_of(share + 1, count) <= item) share++;
        return share;
    }

    /// From now on the caller does all shares itself, one after the other.
    void work_alone(bool alone) { alone_ = alone; }
    bool works_alone() const { return alone_; }

    /// Calls work(share) for each share, and returns when all are done. What the first share in
    /// order throws is thrown.
    template <typename Work> void share(Work work) {
        if (size_ == 1) return work(uint32_t{0});
        if (alone_) {
            for (uint32_t share = 0; share < size_; share++) work(share);
            return;
        }
        hand_out([](void *to_do, uint32_t share) { (*static_cast<Work *>(to_do))(share); }, &work);
    }

    /// Calls work(share, begin, end) for the block of `count` items of each share.
    template <typename Work> void share(size_t count, Work work) {
        share([&](uint32_t number) {
            work(number, begin_of(number, count), begin_of(number + 1, count));
        });
    }

  private:
    using Call = void (*)(void *work, uint32_t share);

    void hand_out(Call call, void *work);
    void serve(uint32_t share, void (*prepare)());
    void do_share(uint32_t share);
    void end();

    uint32_t size_;
    bool alone_ = false;
    Call call_ = nullptr;  ///< the work at hand; null: members go home
    void *work_ = nullptr;
    alignas(64) std::atomic<uint32_t> handed_out_ = 0;  ///< so many works so far
    alignas(64) std::atomic<uint32_t> busy_ = 0;        ///< members that are not done with it
    std::vector<std::exception_ptr> thrown_;            ///< by share
    std::vector<std::thread> threads_;
};

}  // namespace kilotwin

#endif
