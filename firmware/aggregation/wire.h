/// The bytes of every message that `aggregation` sends or understands, and the keys of its
/// parameters.
///
/// This file is the only place that says so: the firmware, the emulator's virtual floor, the module
/// program and the host (through the emulator's Python module) all take the numbers from here.
///
/// Every message is a Kilobot message of nine data bytes and a type. Types 0x10 and 0x40 up belong
/// to the Kilogrid and to kilolib. Numbers of several bytes are little-endian. Unused data bytes
/// are zero when sent, ignored when received.
#ifndef AGGREGATION_WIRE_H
#define AGGREGATION_WIRE_H

#include <stdbool.h>
#include <stdint.h>

#define WIRE_DATA_BYTES 9

enum {
    /// Floor (a grid cell, or the emulator's virtual floor) to the robot above it. data[0] site: 0
    /// none, 1..255 the site's number. data[1] flags: WIRE_CELL_WALL, WIRE_CELL_OBSTACLE.
    WIRE_TYPE_CELL = 0x01,
    /// Robot to robot: "I rest here". data[0..1] uid of the sender. Says nothing about its role.
    WIRE_TYPE_SIGNAL = 0x02,
    /// Host to robots, while they are IDLE: one parameter for a range of robots.
    /// data[0..1] uid_first, data[2..3] uid_last (both inclusive), data[4] key, data[5..8] value.
    WIRE_TYPE_CONFIG = 0x03,
    /// Robot to the cell below, on a Kilogrid: how it is doing. data[0..1] uid, data[2] its LED as
    /// RGB() has it, data[3..4] site and flags of the last CELL (flags 0x80: none
    /// yet), data[5..6] number of the report,
    /// which shows what got lost. The grid passes on WIRE_TRACKING_BYTES.
    WIRE_TYPE_TRACKING = 0x10,
};

#define WIRE_TRACKING_BYTES 7

/// The robot stands on a cell next to the wall (Kilogrid: no proximity sensor).
#define WIRE_CELL_WALL 0x01
/// A wall or a robot is close ahead (foot-bot: proximity ring).
#define WIRE_CELL_OBSTACLE 0x02

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

#define WIRE_CONFIG_ENUM(name, key, preset, least, most) WIRE_KEY_##name = (key),
enum { WIRE_CONFIG_KEYS(WIRE_CONFIG_ENUM) };

typedef struct {
    uint8_t site;
    uint8_t flags;
} wire_cell_t;

typedef struct {
    uint16_t uid;
    uint8_t led;
    wire_cell_t cell;
    uint16_t number;
} wire_tracking_t;

typedef struct {
    uint16_t uid_first;
    uint16_t uid_last;
    uint8_t key;
    uint32_t value;
} wire_config_t;

/// Encoders write all WIRE_DATA_BYTES of `data`; decoders read them. None can fail: a type has one
/// layout.
static inline void wire_put_cell(uint8_t data[WIRE_DATA_BYTES], wire_cell_t cell) {
    data[0] = cell.site;
    data[1] = cell.flags;
    for (uint8_t i = 2; i < WIRE_DATA_BYTES; i++) data[i] = 0;
}

static inline wire_cell_t wire_get_cell(const uint8_t data[WIRE_DATA_BYTES]) {
    return (wire_cell_t){data[0], data[1]};
}

static inline void wire_put_signal(uint8_t data[WIRE_DATA_BYTES], uint16_t uid) {
    data[0] = (uint8_t)uid;
    data[1] = (uint8_t)(uid >> 8);
    for (uint8_t i = 2; i < WIRE_DATA_BYTES; i++) data[i] = 0;
}

static inline uint16_t wire_get_signal(const uint8_t data[WIRE_DATA_BYTES]) {
    return (uint16_t)(data[0] | (uint16_t)data[1] << 8);
}

static inline void wire_put_tracking(uint8_t data[WIRE_DATA_BYTES], wire_tracking_t report) {
    data[0] = (uint8_t)report.uid;
    data[1] = (uint8_t)(report.uid >> 8);
    data[2] = report.led;
    data[3] = report.cell.site;
    data[4] = report.cell.flags;
    data[5] = (uint8_t)report.number;
    data[6] = (uint8_t)(report.number >> 8);
    for (uint8_t i = WIRE_TRACKING_BYTES; i < WIRE_DATA_BYTES; i++) data[i] = 0;
}

static inline wire_tracking_t wire_get_tracking(const uint8_t data[WIRE_TRACKING_BYTES]) {
    return (wire_tracking_t){(uint16_t)(data[0] | (uint16_t)data[1] << 8),
                             data[2],
                             {data[3], data[4]},
                             (uint16_t)(data[5] | (uint16_t)data[6] << 8)};
}

static inline void wire_put_config(uint8_t data[WIRE_DATA_BYTES], wire_config_t config) {
    data[0] = (uint8_t)config.uid_first;
    data[1] = (uint8_t)(config.uid_first >> 8);
    data[2] = (uint8_t)config.uid_last;
    data[3] = (uint8_t)(config.uid_last >> 8);
    data[4] = config.key;
    for (uint8_t i = 0; i < 4; i++) data[5 + i] = (uint8_t)(config.value >> (8 * i));
}

static inline wire_config_t wire_get_config(const uint8_t data[WIRE_DATA_BYTES]) {
    wire_config_t config = {(uint16_t)(data[0] | (uint16_t)data[1] << 8),
                            (uint16_t)(data[2] | (uint16_t)data[3] << 8), data[4], 0};
    for (uint8_t i = 0; i < 4; i++) config.value |= (uint32_t)data[5 + i] << (8 * i);
    return config;
}

#endif
