#include "bus.h"

#include <avr/interrupt.h>
#include <util/delay.h>

#include "address.h"
#include "board.h"

#if CAN_FILTERS != KILOGRID_FILTERS
#error "the controller's filters must hold as many identifiers as a module listens to"
#endif

// For a frame that the host or the bus keeps waiting.
#define TRIES 100
#define TRY_US 100

static uint8_t own_x, own_y;

bool runtime_bus_init(uint8_t x, uint8_t y) {
    uint16_t ids[CAN_FILTERS] = {0};
    own_x = x;
    own_y = y;
    (void)kilogrid_filters(x, y, ids);
    EICRA = BIT(ISC01);  // falls when a frame has come
    return runtime_can_controller_init(ids, KILOGRID_MODULE_MASK);
}

void runtime_bus_listen(void) { EIMSK = BIT(INT0); }

// Infrared pulses go on meanwhile: their interrupt has to be let in. The pin rises only when the
// controller has no frame left, so none is forgotten.
ISR(INT0_vect) {
    can_frame_t frame;
    EIMSK = 0;
    sei();
    while (runtime_can_controller_receive(&frame)) runtime_bus_received(&frame);
    cli();
    EIMSK = BIT(INT0);
}

// The controller's interrupt and the main loop exclude one another.
static bool try_to_send(const can_frame_t *frame) {
    const uint8_t listening = EIMSK;
    EIMSK = 0;
    const bool taken = runtime_can_controller_send(frame);
    EIMSK = listening;
    return taken;
}

// A frame takes 0.5 ms on a free bus; the tries last 10 ms.
bool runtime_bus_send(can_frame_t *frame, uint8_t x, uint8_t y, uint8_t type) {
    frame->id = kilogrid_id((kilogrid_address_t){x, y, type});
    if (frame->id == KILOGRID_NO_ID) return false;
    for (uint8_t tries = 0; tries < TRIES; tries++) {
        if (try_to_send(frame)) return true;
        _delay_us(TRY_US);
    }
    return false;
}

bool runtime_bus_send_to_host(can_frame_t *frame) {
    return runtime_bus_send(frame, own_x, own_y, ADDR_DISPATCHER);
}

void runtime_bus_address_of(uint16_t id, uint8_t address[3]) {
    kilogrid_address_t found = {0, 0, ADDR_BROADCAST};
    (void)kilogrid_address(id, &found);
    address[0] = found.x;
    address[1] = found.y;
    address[2] = found.type;
}

// In the main loop: the interrupt must not use the SPI meanwhile.
can_health_t runtime_bus_health(void) {
    const uint8_t listening = EIMSK;
    EIMSK = 0;
    const can_health_t health = runtime_can_controller_health();
    EIMSK = listening;
    return health;
}
