#include "bus.h"

#include <avr/interrupt.h>
#include <stddef.h>
#include <util/atomic.h>

#include "../../../firmware/kilolib/core/calibration.h"
#include "../../runtime/core/eeprom_map.h"
#include "address.h"
#include "board.h"

#define QUEUE_LENGTH 64  // a power of two

static can_frame_t queue[QUEUE_LENGTH];
// The interrupt puts at `head`, the main program takes at `tail`; equal: nothing is there.
static volatile uint8_t head, tail;
static uint16_t ids[CAN_FILTERS];  // that the module listens to; all 0 if it has no place

static uint8_t behind(uint8_t place) { return (uint8_t)((place + 1) & (QUEUE_LENGTH - 1)); }

// The place at `head` is free in any case.
static void take_frames(void) {
    while (runtime_can_controller_receive(&queue[head])) {
        const uint8_t next = behind(head);
        if (next != tail) head = next;
    }
}

// The controller's interrupt pin is that of INT0, whose vector is the loader's second entry: it is
// taken as a change of the pin. The pin rises only when the controller has no frame left.
ISR(PCINT2_vect) { take_frames(); }

// No edge of the pin is missed: it counts from here on, and is taken once interrupts come.
void boot_bus_init(void) {
    (void)kilogrid_filters(kilolib_eeprom_read(EEPROM_X), kilolib_eeprom_read(EEPROM_Y), ids);
    PCMSK2 = CAN_INTERRUPT;
    PCICR = BIT(PCIE2);
    // A controller without a clock does not answer; without it the module cannot be reached.
    while (!runtime_can_controller_init(ids, KILOGRID_MODULE_MASK)) {
    }
}

const can_frame_t *boot_bus_oldest(void) { return tail != head ? &queue[tail] : NULL; }

// The compiler may not read the frame later than this.
void boot_bus_drop_oldest(void) {
    __asm__ volatile("" ::: "memory");
    tail = behind(tail);
}

bool boot_bus_send(can_frame_t *frame) {
    bool taken = true;
    const uint16_t own = ids[ADDR_INDIVIDUAL];
    frame->id = own | KILOGRID_HOST_ID;
    frame->length = CAN_DATA_MAX;
    if (own == 0) return true;
    ATOMIC_BLOCK(ATOMIC_FORCEON) { taken = runtime_can_controller_send(frame); }
    return taken;
}
