/// Driver of the CAN controller, an MCP2515 with a clock of 8 MHz, at 250 kbit/s (hardware.md 3.2).
///
/// Not reentrant: the main loop and the controller's interrupt must exclude one another (bus.c). A
/// call takes some 100 us of SPI.
#ifndef MODULE_AVR_CAN_CONTROLLER_H
#define MODULE_AVR_CAN_CONTROLLER_H

#include <stdbool.h>
#include <stdint.h>

/// Identifiers that the controller's filters hold.
#define CAN_FILTERS 4
#define CAN_DATA_MAX 8

typedef struct {
    uint16_t id;
    bool rtr;
    uint8_t length;
    uint8_t data[CAN_DATA_MAX];
} can_frame_t;

/// Errors of the controller; `missed` since the last call of runtime_can_controller_health().
typedef struct {
    uint8_t transmit_errors;  ///< TEC, 0..255
    uint8_t receive_errors;   ///< REC, 0..255
    uint8_t missed;           ///< 1: both buffers were full, at least one frame was lost
} can_health_t;

/// Resets the controller. From then on it takes frames whose identifier, under `mask`, is one of
/// `ids`, and pulls its interrupt line low while it has one. False if no controller answers.
bool runtime_can_controller_init(const uint16_t ids[CAN_FILTERS], uint16_t mask);

/// Takes the oldest frame out of the two receive buffers; false: both are empty.
bool runtime_can_controller_receive(can_frame_t *frame);

/// Queues a frame in the one transmit buffer that is used, so that frames keep their order. False
/// if the frame before still waits for the bus.
bool runtime_can_controller_send(const can_frame_t *frame);

/// Reads the error counters, and clears the mark of missed frames.
can_health_t runtime_can_controller_health(void);

#endif
