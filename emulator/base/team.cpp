#include "base/team.h"

#include <string>
#include <system_error>
#include <utility>

#include "base/errors.h"

namespace kilotwin {

namespace {

// Some 20 us: as long as another thread needs to wake up.
constexpr int TURNS_BEFORE_SLEEP = 500;

/// Returns when `value` is no longer `old`.
uint32_t wait_while(const std::atomic<uint32_t> &value, uint32_t old) {
    for (int turn = 0; turn < TURNS_BEFORE_SLEEP; turn++) {
        const uint32_t now = value.load(std::memory_order_acquire);
        if (now != old) return now;
        __builtin_ia32_pause();
    }
    value.wait(old, std::memory_order_acquire);
    return value.load(std::memory_order_acquire);
}

}  // namespace

Team::Team(uint32_t members, void (*prepare)()) : size_(members), thrown_(members) {
    busy_ = members - 1;
    try {
        for (uint32_t share = 1; share < members; share++)
            threads_.emplace_back([this, share, prepare] { serve(share, prepare); });
    } catch (const std::system_error &error) {
        busy_ -= members - 1 - static_cast<uint32_t>(threads_.size());
        end();
        throw EngineError("engine.threads = " + std::to_string(members) +
                          ": no more threads can be started: " + error.what());
    }
    while (const uint32_t busy = busy_.load(std::memory_order_acquire)) wait_while(busy_, busy);
}

Team::~Team() { end(); }

void Team::end() {
    call_ = nullptr;
    handed_out_.fetch_add(1, std::memory_order_release);
    handed_out_.notify_all();
    for (std::thread &thread : threads_) thread.join();
}

void Team::hand_out(Call call, void *work) {
    call_ = call;
    work_ = work;
    busy_.store(size_ - 1, std::memory_order_relaxed);
    handed_out_.fetch_add(1, std::memory_order_release);
    handed_out_.notify_all();
    do_share(0);
    while (const uint32_t busy = busy_.load(std::memory_order_acquire)) wait_while(busy_, busy);
    for (std::exception_ptr &thrown : thrown_)
        if (thrown) {
            const std::exception_ptr first = std::exchange(thrown, nullptr);
            for (std::exception_ptr &one : thrown_) one = nullptr;
            std::rethrow_exception(first);
        }
}

void Team::do_share(uint32_t share) {
    try {
        call_(work_, share);
    } catch (...) {
        thrown_[share] = std::current_exception();
    }
}

void Team::serve(uint32_t share, void (*prepare)()) {
    uint32_t seen = 0;
    if (prepare != nullptr) prepare();
    auto is_done = [this] {
        if (busy_.fetch_sub(1, std::memory_order_acq_rel) == 1) busy_.notify_one();
    };
    is_done();
    for (;;) {
        seen = wait_while(handed_out_, seen);
        if (call_ == nullptr) return;
        do_share(share);
        is_done();
    }
}

}  // namespace kilotwin
