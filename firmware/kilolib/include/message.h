/// The message that robots, overhead controllers and Kilogrid cells exchange by infrared light.
#ifndef __MESSAGES_H__
#define __MESSAGES_H__  // NOLINT(bugprone-reserved-identifier): programs know it

#include <stdint.h>

/// Type of a message. Types below 0x80 reach the program's callback; the others are commands to
/// the robot itself, and no program ever sees one. One byte on the robot (-fshort-enums).
typedef enum {
    NORMAL = 0x00,        ///< a program's own
    GPS = 0x01,           ///< likewise: where a robot is, by an overhead controller (ohc.h)
    BOOT = 0x80,          ///< enter the boot loader
    BOOTPGM_PAGE = 0x81,  ///< for the boot loader (hardware.md 1.11)
    BOOTPGM_SIZE = 0x82,  ///< likewise
    RESET = 0x83,         ///< start again from main(), kilo_ticks from 0
    SLEEP = 0x84,         ///< low power until WAKEUP
    WAKEUP = 0x85,        ///< IDLE, also used as "pause"
    CHARGE = 0x86,        ///< show on the LED whether the charger is at work
    VOLTAGE = 0x87,       ///< show the battery voltage on the LED
    RUN = 0x88,           ///< setup() if it never ran, then loop()
    READUID = 0x89,       ///< turn left if bit data[0] of the uid is set
    CALIB = 0x8A,         ///< try, or save, motor values and uid
} message_type_t;

/// 12 bytes, on air in this order, lowest byte of the crc first.
typedef struct {
    uint8_t data[9];
    uint8_t type;  ///< a message_type_t, or any user type 0x02..0x7F
    uint16_t crc;  ///< message_crc() of the above; a receiver drops a message whose crc is wrong
} message_t;

/// How strongly a message was received, in raw units of the 10-bit converter (0..1023).
/// estimate_distance() makes millimetres of it.
typedef struct {
    int16_t low_gain;
    int16_t high_gain;
} distance_measurement_t;

/// A message with a right crc came in. Runs in an interrupt: be short. Both pointers are valid
/// until it returns.
typedef void (*message_rx_t)(message_t *, distance_measurement_t *);

/// A message may go out now. Returns it, crc included, or NULL to stay silent until the next tick.
/// Runs in an interrupt.
typedef message_t *(*message_tx_t)(void);

/// The message that message_tx_t returned is on air in full. Runs in an interrupt.
typedef void (*message_tx_success_t)(void);

#endif
