/// The bytes of every message that `aggregation` sends or understands. The keys of its parameters,
/// with their defaults, come from default_params.h.
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

#include "default_params.h"

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

/// WIRE_KEY_BETA and the others: data[4] of a CONFIG message.
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
