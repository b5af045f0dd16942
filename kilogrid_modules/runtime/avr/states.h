/// What a module does at present (hardware.md 3.3). Frames from the bus change it; module_start()
/// acts on it.
#ifndef MODULE_AVR_STATES_H
#define MODULE_AVR_STATES_H

#include <stdbool.h>
#include <stdint.h>

#include "CAN.h"
#include "transfer.h"

/// In the order of the health report.
typedef enum {
    STATE_INIT,
    STATE_IDLE,                  ///< breathes white
    STATE_SETUP_KILOBOTS,        ///< repeats an infrared message for robots
    STATE_WAITING_FOR_PAGE,      ///< a page of a robots' program is coming
    STATE_BOOTLOADING_KILOBOTS,  ///< it goes out to them
    STATE_WAITING_FOR_CONFIGURATION,
    STATE_SETUP,    ///< setup(), once after each configuration
    STATE_RUNNING,  ///< loop()
} module_state_t;

extern volatile module_state_t runtime_module_state;

/// What comes in by the bus.
extern transfer_t runtime_transfer;

/// What the bus wants of the main loop.
typedef struct {
    volatile bool set_up;             ///< setup() has run since the last configuration
    volatile bool started;            ///< RUN has been sent to the robots
    volatile bool page;               ///< runtime_transfer.kilo holds a page for the robots
    volatile bool poll;               ///< the host wants the tracking records
    volatile uint8_t health;          ///< and these parts of the health: a bit each
    volatile uint8_t page_cell;       ///< the cell by which pages go out
    volatile uint8_t pages_received;  ///< in this round
} orders_t;

extern orders_t runtime_orders;

/// Changes the state; leaving RUNNING forgets that the robots were started.
void runtime_enter_state(module_state_t state);

/// Frames that were refused or missed, since power-up; stays at 255.
uint8_t runtime_frames_refused(void);
void runtime_count_refused(uint8_t frames);

#endif
