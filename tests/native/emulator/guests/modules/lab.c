// In the manner of the labs' programs: each cell says its configuration byte and the module's
// place, shows it, and passes on what robots report. Robots may also drop something on a cell,
// which goes away again by itself.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>
#include <util/delay.h>

#include "CAN.h"
#include "kilogrid.h"
#include "module.h"
#include "moduleIR.h"
#include "moduleLED.h"

#define CELL_STATE 1
#define DROP 0x21
#define ADVERTISE_EVERY (TICKS_PER_SEC / 2)
#define EVAPORATES_AFTER SEC_TO_TICKS(4)

typedef enum { false = 0, true = 1 } bool;

volatile uint8_t state[N_CELLS];
volatile uint8_t dropped[N_CELLS];
uint32_t evaporation[N_CELLS];
uint32_t advertise_at;
uint8_t setups;
bool lit = false;
cell_num_t cell_id[4] = {CELL_00, CELL_01, CELL_02, CELL_03};
IR_message_t message_tx[N_CELLS];

void IR_rx(IR_message_t *m, cell_num_t c, distance_measurement_t *d, uint8_t CRC_error) {
    if (CRC_error) return;
    if (m->type == TRACKING) {
        CAN_message_t *msg = next_CAN_message();
        if (msg != NULL) serialize_tracking_message(msg, c, m->data);
    }
    if (m->type == DROP) {
        dropped[c]++;
        evaporation[c] = module_ticks + EVAPORATES_AFTER;
    }
}

void setup() {
    setups++;
    for (int i = 0; i < N_CELLS; ++i) {
        state[i] = configuration[i];
        dropped[i] = 0;
    }
    lit = false;
    advertise_at = 0;
}

static inline void advertise() {
    for (int i = 0; i < N_CELLS; ++i) {
        message_tx[i].type = CELL_STATE;
        message_tx[i].data[0] = state[i];
        message_tx[i].data[1] = dropped[i];
        message_tx[i].data[2] = module_uid_x_coord;
        message_tx[i].data[3] = module_uid_y_coord;
        message_tx[i].data[4] = setups;
        set_IR_message(&message_tx[i], i);
    }
}

void loop() {
    if (!lit) {
        for (int i = 0; i < N_CELLS; ++i)
            set_LED_with_brightness(cell_id[i], state[i] & 7, state[i] > 7 ? 10 : HIGH);
        lit = true;
    }
    for (int i = 0; i < N_CELLS; ++i) {
        if (dropped[i] > 0 && module_ticks > evaporation[i]) {
            dropped[i]--;
            evaporation[i] = module_ticks + EVAPORATES_AFTER;
        }
    }
    if (module_ticks >= advertise_at) {
        advertise();
        advertise_at = module_ticks + ADVERTISE_EVERY;
    }
}

int main() {
    module_init();
    module_IR_message_rx = IR_rx;
    module_start(setup, loop);
    return 0;
}
