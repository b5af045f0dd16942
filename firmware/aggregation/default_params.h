/// The parameters of `aggregation`: key, default and range of each. The firmware, the emulator and
/// the host take them from here, by way of wire.h.
#ifndef AGGREGATION_DEFAULT_PARAMS_H
#define AGGREGATION_DEFAULT_PARAMS_H

/// The parameters: X(name, key, default, least, most). Values are uint32_t; `Q16` is a real number
/// times 65,536. The defaults are those of a Kilobot (design: the hex must be useful with no CONFIG
/// at all); ticks are 32.768 ms. A value outside least..most is refused and the old one stays.
///
///   RULE               0 simplified, 1 Firat
///   ALPHA BETA         simplified rule, P = alpha exp(-beta n), Q16
///   FIRAT_A FIRAT_K    Firat's rule, P = exp(-a (k - |n - x|)), Q16
///   UPDATE_TICKS       period of the leave test
///   STRAIGHT_TICKS     length of a straight leg of the random walk
///   ENTRY_TICKS        walk straight on after entering a site
///   RHO                concentration of the wrapped Cauchy turning angle, Q16, 0 uniform to < 1
///   TURN_TICKS_PER_RAD duration of a turn by one radian, Q16
///   WINDOW_TICKS       a sender counts if it was heard at most so long ago
///   TIMEOUT_TICKS      a sender's place in the table is given back after so long without a message
///   CAPACITY           places in the table of neighbours
///   EMPTY_WINDOWS      Firat: so many empty windows in a row mean n = 0
///   INFORMED_SITE      0: not informed; s: informed for site s
///   STEP_TICKS         control step: how soon after coming to rest the first leave test may be
///   WALL_IGNORE_TICKS  after turning away from a wall cell its warning is ignored so long
///   LEAVE_TURN         1: a fresh random turn after every straight leg while leaving (Kilobots)
///   TRACKING_TICKS     period of the TRACKING reports, 0 none
/// and the readings of what the paper leaves open, values in the order of paper.md 4:
///   SIGNAL_FROM 0 rest 1 crossing; FIRST_LEAVE 0 next_step 1 full_period; WALK_OUT 0 walk 1 rest;
///   ENTRY_OBSTACLE 0 turn 1 rest 2 pause; COUNT_SELF 0 no 1 yes; FIRAT_JOIN 0 crossing
///   1 first_update 2 every_update; FIRAT_SIGNAL_FROM 0 crossing 1 rest; START_ON_SITE 0 entered
///   1 must_leave; UPDATE_CLOCK 0 own 1 common; and PUSHED_OFF 0 stay 1 walk, which matters where
///   robots can be pushed.
#define WIRE_CONFIG_KEYS(X)                           \
    X(RULE, 1, 0, 0, 1)                               \
    X(ALPHA, 2, 32768, 0, 0xFFFFFFFF)                 \
    X(BETA, 3, 147456, 0, 0xFFFFFFFF)                 \
    X(FIRAT_A, 4, 131072, 0, 0xFFFFFFFF)              \
    X(FIRAT_K, 5, 1179648, 0, 0xFFFFFFFF)             \
    X(UPDATE_TICKS, 6, 76, 1, 65535)                  \
    X(STRAIGHT_TICKS, 7, 191, 1, 65535)               \
    X(ENTRY_TICKS, 8, 381, 0, 65535)                  \
    X(RHO, 9, 32768, 0, 65535)                        \
    X(TURN_TICKS_PER_RAD, 10, 2540000, 1, 0xFFFFFFFF) \
    X(WINDOW_TICKS, 11, 76, 1, 32000)                 \
    X(TIMEOUT_TICKS, 12, 76, 1, 32000)                \
    X(CAPACITY, 13, 100, 1, 100)                      \
    X(EMPTY_WINDOWS, 14, 2, 1, 255)                   \
    X(INFORMED_SITE, 15, 0, 0, 255)                   \
    X(STEP_TICKS, 16, 3, 1, 65535)                    \
    X(WALL_IGNORE_TICKS, 17, 488, 0, 65535)           \
    X(LEAVE_TURN, 18, 1, 0, 1)                        \
    X(TRACKING_TICKS, 19, 0, 0, 65535)                \
    X(SIGNAL_FROM, 32, 0, 0, 1)                       \
    X(FIRST_LEAVE, 33, 0, 0, 1)                       \
    X(WALK_OUT, 34, 0, 0, 1)                          \
    X(ENTRY_OBSTACLE, 35, 0, 0, 2)                    \
    X(COUNT_SELF, 36, 0, 0, 1)                        \
    X(FIRAT_JOIN, 37, 0, 0, 2)                        \
    X(FIRAT_SIGNAL_FROM, 38, 0, 0, 1)                 \
    X(START_ON_SITE, 39, 0, 0, 1)                     \
    X(UPDATE_CLOCK, 40, 0, 0, 1)                      \
    X(PUSHED_OFF, 41, 1, 0, 1)

#endif
