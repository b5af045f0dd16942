/// The CAN controller, an MCP2515 with a clock of 8 MHz, at 250 kbit/s (hardware.md 3.2).
#ifndef MODULE_AVR_CAN_CONTROLLER_H
#define MODULE_AVR_CAN_CONTROLLER_H

#include <stdbool.h>
#include <stdint.h>

/// Identifiers that the controller can be told to take.
#define CAN_FILTERS 4
#define CAN_DATA_MAX 8

typedef struct {
    uint16_t id;
    bool rtr;
    uint8_t length;
    uint8_t data[CAN_DATA_MAX];
} can_frame_t;

/// Since the controller was asked last.
typedef struct {
    uint8_t transmit_errors;  ///< TEC, as it stands
    uint8_t receive_errors;   ///< REC, as it stands
    uint8_t missed;           ///< both buffers were full: at least so many frames were lost
} can_health_t;

/// Resets the controller and lets it take frames with these identifiers, compared under `mask`. It
/// interrupts when it has one. False if no controller answers.
bool runtime_can_controller_init(const uint16_t ids[CAN_FILTERS], uint16_t mask);

/// Takes a frame out of the controller; false: there is none.
bool runtime_can_controller_receive(can_frame_t *frame);

/// Hands over a frame to be sent. False if the one before is still waiting for the bus.
bool runtime_can_controller_send(const can_frame_t *frame);

can_health_t runtime_can_controller_health(void);

#endif
