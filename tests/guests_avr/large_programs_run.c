// 16 KB of code for the robot, and more: 256 functions that differ, called through a table.
#include "check.h"

#define F(n)                                                     \
    static uint16_t function_##n(uint16_t x) {                   \
        volatile uint16_t seed = x;                              \
        for (uint8_t i = 0; i < (0x##n & 7); i++) seed += 0x##n; \
        return (uint16_t)(seed ^ 0x1##n);                        \
    }
// clang-format off
#define F16(n)                                                                              \
    F(n##0)                                                                                 \
    F(n##1)                                                                                 \
    F(n##2)                                                                                 \
    F(n##3) F(n##4) F(n##5) F(n##6) F(n##7) F(n##8) F(n##9) F(n##A) F(n##B) F(n##C) F(n##D) \
        F(n##E) F(n##F)
#define NAME(n) function_##n,
#define NAME16(n)                                                                           \
    NAME(n##0)                                                                              \
    NAME(n##1)                                                                              \
    NAME(n##2)                                                                              \
    NAME(n##3) NAME(n##4) NAME(n##5) NAME(n##6) NAME(n##7) NAME(n##8) NAME(n##9) NAME(n##A) \
        NAME(n##B) NAME(n##C) NAME(n##D) NAME(n##E) NAME(n##F)

F16(0)
F16(1)
F16(2)
F16(3)
F16(4) F16(5) F16(6) F16(7) F16(8) F16(9) F16(A) F16(B) F16(C) F16(D) F16(E) F16(F)
    // clang-format on

    static uint16_t (*const functions[])(uint16_t) = {
        NAME16(0) NAME16(1) NAME16(2) NAME16(3) NAME16(4) NAME16(5) NAME16(6) NAME16(7) NAME16(8)
            NAME16(9) NAME16(A) NAME16(B) NAME16(C) NAME16(D) NAME16(E) NAME16(F)};

static void check(void) {
    for (uint16_t n = 0; n < 256; n++) {
        const uint16_t expected = (uint16_t)((1000 + (n & 7) * n) ^ (0x100 + n));
        CHECK(functions[n](1000) == expected);
    }
}
