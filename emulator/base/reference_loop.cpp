#include "base/reference_loop.h"

#include <cstddef>
#include <cstdint>
#include <ctime>
#include <vector>

namespace kilotwin {

namespace {

constexpr size_t TURNS = 12'000'000, TABLE = 4096;
constexpr uint64_t FACTOR = 6364136223846793005, TERM = 1442695040888963407;

double thread_cpu_s() {
    timespec time = {};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

double reference_loop_s() {
    std::vector<uint64_t> table(TABLE, 1);
    const double began = thread_cpu_s();
    uint64_t state = 1;
    double sum = 0;
    for (size_t turn = 0; turn < TURNS; turn++) {
        state = state * FACTOR + TERM;
        uint64_t &entry = table[state >> 52];
        if ((state >> 40 & 1) != 0)
            entry += state;
        else
            sum = sum * 0.5 + static_cast<double>(entry >> 32);
    }
    [[maybe_unused]] const volatile double result = sum + static_cast<double>(state >> 32);
    return thread_cpu_s() - began;
}

}  // namespace kilotwin
