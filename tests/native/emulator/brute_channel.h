/// The infrared channel by brute force, microsecond by microsecond: what a robot's timer, its
/// transmitter and its receiver do, written from the description of the hardware (hardware.md 1.6)
/// and sharing nothing with the engine. Robots stand still and always have something to say.
#ifndef KILOTWIN_BRUTE_CHANNEL_H
#define KILOTWIN_BRUTE_CHANNEL_H

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

namespace kilotwin::testing {

struct BruteCounts {
    double sent = 0, received = 0, collided = 0, deaf = 0, failed = 0;
};

class BruteChannel {
  public:
    /// `audible[i]`: which robots receive robot i. Clocks differ by a normal share of sd
    /// `clock_spread`.
    BruteChannel(std::vector<std::vector<int>> audible, double clock_spread, uint64_t seed)
        : audible_(std::move(audible)),
          robots_(audible_.size()),
          random_(seed) {
        std::normal_distribution<double> rate(1, clock_spread);
        std::uniform_real_distribution<double> phase(0, 1);
        for (auto &robot : robots_) {
            robot.tick_us = TICK_US * rate(random_);
            robot.next_regular = robot.next_tick = robot.tick_us * phase(random_);
        }
    }

    BruteCounts run(double duration_s) {
        const auto end = static_cast<int64_t>(duration_s * 1e6);
        for (int64_t now = 0; now < end; now++) {
            const auto us = static_cast<double>(now);
            for (size_t i = 0; i < robots_.size(); i++) step(static_cast<int>(i), us);
            if (std::none_of(robots_.begin(), robots_.end(), [](auto &r) { return r.sending; }))
                now = std::max(now, static_cast<int64_t>(earliest_tick()) - 1);  // all is dark
        }
        return counts_;
    }

  private:
    static constexpr double TICK_US = 32768, COUNT_US = 128, SLOT_US = 33.625, FRAME_US = 4371;
    static constexpr double NOTICE_US = 9;  // a pulse, and the entry of its interrupt
    static constexpr double POLL_FROM_US = 2 * SLOT_US, POLL_TO_US = POLL_FROM_US + 235;
    static constexpr double LEADER_STOP_US = 9 * SLOT_US;
    static constexpr int PERIOD_COUNTS = 3906, MATCH_COUNTS = 255;

    enum class Fate { CLEAR, COLLIDED, DEAF };

    struct Robot {
        double tick_us = 0, next_tick = 0, next_regular = 0;
        int tx_clock = PERIOD_COUNTS, increment = MATCH_COUNTS;  // long overdue when RUN comes
        bool sending = false, polled = false, saw_light = false;
        double began = 0;
        std::vector<Fate> fates;    // of its frame, by listener
        std::vector<int> arriving;  // whose light falls on it
    };

    double earliest_tick() const {
        return std::min_element(robots_.begin(), robots_.end(),
                                [](auto &a, auto &b) { return a.next_tick < b.next_tick; })
            ->next_tick;
    }

    void step(int index, double now) {
        Robot &robot = robots_[static_cast<size_t>(index)];
        if (robot.sending) {
            const double since = now - robot.began;
            if (since >= POLL_FROM_US && since < POLL_TO_US)
                robot.saw_light |= light_on(robot, now);
            if (since >= POLL_TO_US && !robot.polled) {
                robot.polled = true;
                if (robot.saw_light) return abort_attempt(index, now);
            }
            if (since >= FRAME_US) end_frame(index);
        }
        if (robot.next_tick <= now) tick(index, now);
    }

    /// A pulse of the leader of a sender in its range, in this microsecond.
    bool light_on(const Robot &robot, double now) const {
        auto at = [now](double pulse) { return pulse >= now && pulse < now + 1; };
        return std::any_of(robot.arriving.begin(), robot.arriving.end(), [&](int other) {
            const Robot &sender = robots_[static_cast<size_t>(other)];
            return at(sender.began) || at(sender.began + LEADER_STOP_US);
        });
    }

    void tick(int index, double now) {
        Robot &robot = robots_[static_cast<size_t>(index)];
        robot.tx_clock += robot.increment;
        robot.increment = MATCH_COUNTS;
        if (robot.next_tick >= robot.next_regular) robot.next_regular += robot.tick_us;
        robot.next_tick = robot.next_regular;
        const bool receiving =
            std::any_of(robot.arriving.begin(), robot.arriving.end(), [&](int other) {
                return robots_[static_cast<size_t>(other)].began + NOTICE_US <= now;
            });
        if (robot.tx_clock > PERIOD_COUNTS && !receiving && !robot.sending) begin(index, now);
    }

    void begin(int index, double now) {
        Robot &robot = robots_[static_cast<size_t>(index)];
        const auto &listeners = audible_[static_cast<size_t>(index)];
        robot.sending = true;
        robot.polled = robot.saw_light = false;
        robot.began = now;
        robot.fates.assign(listeners.size(), Fate::CLEAR);
        for (int sender : robot.arriving) spoil(sender, index, Fate::DEAF);
        for (size_t i = 0; i < listeners.size(); i++) {
            Robot &listener = robots_[static_cast<size_t>(listeners[i])];
            if (listener.sending)
                robot.fates[i] = Fate::DEAF;
            else if (!listener.arriving.empty())
                robot.fates[i] = Fate::COLLIDED;
            for (int sender : listener.arriving) spoil(sender, listeners[i], Fate::COLLIDED);
            listener.arriving.push_back(index);
        }
    }

    void spoil(int sender, int listener, Fate fate) {
        const auto &listeners = audible_[static_cast<size_t>(sender)];
        auto place = std::find(listeners.begin(), listeners.end(), listener) - listeners.begin();
        Fate &of_it = robots_[static_cast<size_t>(sender)].fates[static_cast<size_t>(place)];
        if (of_it == Fate::CLEAR || fate == Fate::DEAF) of_it = fate;
    }

    void go_dark(int index) {
        robots_[static_cast<size_t>(index)].sending = false;
        for (int other : audible_[static_cast<size_t>(index)])
            std::erase(robots_[static_cast<size_t>(other)].arriving, index);
    }

    // The timer runs on; its compare value is somewhere else now, and counts as a tick.
    void abort_attempt(int index, double now) {
        Robot &robot = robots_[static_cast<size_t>(index)];
        counts_.failed++;
        go_dark(index);
        const int compare = std::uniform_int_distribution<int>(0, MATCH_COUNTS)(random_);
        const double count_us = COUNT_US * robot.tick_us / TICK_US;
        double match = robot.next_regular - (MATCH_COUNTS - compare) * count_us;
        if (match <= now) match += robot.tick_us;
        robot.increment = compare;
        robot.next_tick = match;
        robot.next_regular = std::max(robot.next_regular, match);
    }

    void end_frame(int index) {
        Robot &robot = robots_[static_cast<size_t>(index)];
        counts_.sent++;
        for (Fate fate : robot.fates)
            (fate == Fate::CLEAR      ? counts_.received
             : fate == Fate::COLLIDED ? counts_.collided
                                      : counts_.deaf)++;
        robot.tx_clock = 0;
        go_dark(index);
    }

    std::vector<std::vector<int>> audible_;
    std::vector<Robot> robots_;
    std::mt19937_64 random_;
    BruteCounts counts_;
};

}  // namespace kilotwin::testing

#endif
