/// Orders of the host to a module: what each CAN frame changes, and the state that the module is in
/// afterwards (hardware.md 3.2, 3.3).
///
/// Pure: no input or output, no clock, no registers. The driver owns the orders_t, passes in every
/// frame that the controller's filters let through, and carries out the order_t that comes back;
/// main_loop.h says what the module's main loop does next.
///
/// Interrupts: orders_receive() may interrupt the main loop, nothing may interrupt orders_receive()
/// that calls a function of this header. Functions that the main loop must call with interrupts off
/// say so. `refused` may be counted up by the main loop too: a count lost in that race is harmless.
#ifndef MODULE_CORE_ORDERS_H
#define MODULE_CORE_ORDERS_H

#include <stdbool.h>
#include <stdint.h>

#include "../../../firmware/kilolib/core/robot_query.h"
#include "kilogrid_can.h"
#include "robot_reports.h"
#include "transfer.h"

#ifdef __cplusplus
extern "C" {
#endif

/// States of a module, numbered as in the health report.
typedef enum {
    STATE_INIT = KILOGRID_CAN_TO_HOST_STATE_INIT_CHOICE,
    STATE_IDLE = KILOGRID_CAN_TO_HOST_STATE_IDLE_CHOICE,  ///< the lights breathe white
    /// All cells repeat an infrared message for the robots.
    STATE_SETUP_KILOBOTS = KILOGRID_CAN_TO_HOST_STATE_SETUP_KILOBOTS_CHOICE,
    /// A page of the robots' program is coming in by CAN.
    STATE_WAITING_FOR_PAGE = KILOGRID_CAN_TO_HOST_STATE_WAITING_FOR_BOOTPAGE_CHOICE,
    /// That page is complete and goes out by infrared.
    STATE_BOOTLOADING_KILOBOTS = KILOGRID_CAN_TO_HOST_STATE_BOOTLOADING_KILOBOTS_CHOICE,
    STATE_WAITING_FOR_CONFIGURATION = KILOGRID_CAN_TO_HOST_STATE_WAITING_FOR_CONFIGURATION_CHOICE,
    STATE_SETUP = KILOGRID_CAN_TO_HOST_STATE_SETUP_CHOICE,      ///< setup(), once per configuration
    STATE_RUNNING = KILOGRID_CAN_TO_HOST_STATE_RUNNING_CHOICE,  ///< RUN to the robots, then loop()
    STATE_BOOT_LOADER = KILOGRID_CAN_TO_HOST_STATE_BOOTLOADER_CHOICE,  ///< the module's own
} module_state_t;

/// Actions that a frame wants of the driver.
typedef enum {
    ORDER_DONE,         ///< nothing: `state` and the flags say it all
    ORDER_REFUSED,      ///< nothing: the frame changed nothing and was counted
    ORDER_HAND_OVER,    ///< call the program's callback for CAN frames
    ORDER_CONFIG_SIZE,  ///< the program's configuration_size = transfer.config.size
    ORDER_CONFIGURE,    ///< and its configuration = so many bytes of transfer.config.data
    ORDER_FORWARD,      ///< call orders_forward() with the module's place and calibration area
    ORDER_SILENCE,      ///< the cells stop repeating their messages
    ORDER_BOOT_LOADER,  ///< jump to the module's boot loader
} order_t;

/// State and pending work of a module; its fields may be read at any time. 423 bytes on the module.
typedef struct {
    volatile uint8_t state;               ///< a module_state_t
    volatile bool autostart;              ///< SETUP and RUN follow without the host
    volatile bool set_up;                 ///< setup() has been called since the last configuration
    volatile bool started;                ///< RUN has been sent to the robots since RUNNING began
    volatile bool page;                   ///< transfer.kilo holds a page that has not gone out
    volatile bool poll;                   ///< the host has requested the tracking records
    volatile uint8_t health;              ///< and these parts of the health report: bit per part
    volatile uint8_t page_cell;           ///< the cell by which pages go out, 0..3
    volatile uint8_t page_received;       ///< pages that came in during this lap
    volatile bool ask;                    ///< `question` has not gone out to the robots
    uint8_t question[ROBOT_QUERY_BYTES];  ///< data of the infrared message
    volatile uint8_t refused;             ///< frames refused or missed since power-up; stays at 255
    transfer_t transfer;                  ///< what takes more than one frame
    robot_reports_t reports;              ///< robots' answers that have not gone out
} orders_t;

/// Calibration area: where CALIB is forwarded, as it lies in the EEPROM from
/// EEPROM_CALIB_RESTRICTED on. Robots elsewhere keep their motor values.
typedef struct {
    uint8_t restricted;  ///< 1: only within the bounds that are not erased (0xFF)
    uint8_t x_min, x_max, y_min, y_max;
} calibration_area_t;

/// Power-up: STATE_INIT, nothing received.
void orders_init(orders_t *orders);

/// Takes a frame of `length` data bytes, 0..8. A remote frame and one without data are refused.
/// About 2,000 cycles on the module, most of them to unpack the frame.
order_t orders_receive(orders_t *orders, const uint8_t *data, uint8_t length, bool remote);

/// Begins to forward the infrared message in transfer.ir, after ORDER_FORWARD. False if it is a
/// CALIB and module (x, y) lies outside the calibration area: the state stays.
bool orders_forward(orders_t *orders, uint8_t x, uint8_t y, const calibration_area_t *area);

/// Counts frames that were refused, or missed by the controller.
void orders_count_refused(orders_t *orders, uint8_t frames);

/// Whether frames of this type carry the module's own program, by their new names or by the old
/// ones, 0x9F higher, that deployed boot loaders know. Outside the boot loader the module's program
/// gets them.
bool orders_is_own_program(uint8_t type);

/// Whether a frame of this type makes the boot loader start the module's program: SETUP, RUN, IDLE
/// and the old name of IDLE.
bool orders_leaves_boot_loader(uint8_t type);

/// module_start() was called: the state becomes SETUP with autostart, else IDLE, unless a frame has
/// changed it already. Interrupts off.
void orders_begin(orders_t *orders);

/// Takes up SETUP: true if setup() has to be called now.
bool orders_begin_setup(orders_t *orders);

/// setup() has come back, or had no need to run: with autostart RUNNING follows. Interrupts off.
void orders_end_setup(orders_t *orders);

/// Takes the request for the tracking records. True if there was one.
bool orders_take_poll(orders_t *orders);

/// Takes the request for a part of the health report, 0 or 1. True if there was one. Interrupts
/// off.
bool orders_take_health(orders_t *orders, uint8_t part);

/// Whether the host has requested anything that was not taken, or has an answer of a robot to come.
static inline bool orders_answer_due(const orders_t *orders) {
    return orders->poll || orders->health != 0 || orders->reports.used != 0;
}

#ifdef __cplusplus
}
#endif

#endif
