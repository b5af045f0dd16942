/* Pheromone: robots that stand on a cell leave some, it evaporates, and the cell sends the amount.
 * configuration[0..3]: what each cell is. */
#include <avr/io.h>
#include <avr/wdt.h>
#include <util/delay.h>

#include "CAN.h"
#include "module.h"
#include "moduleIR.h"
#include "moduleLED.h"

#define OBSTACLE 1
#define MSG_CELL 1
#define MSG_DEPOSIT 5
#define ADVERTISE_TICKS (TICKS_PER_SEC / 2)
#define EVAPORATION_TICKS (20 * TICKS_PER_SEC)
#define DEPOSIT 16

typedef struct {
    uint8_t kind;
    volatile uint8_t pheromone;
} cell_t;

static cell_t cells[N_CELLS];
static IR_message_t *tx;
static uint32_t last_advertised, last_evaporated;
static const cell_num_t ids[] = {CELL_00, CELL_01, CELL_02, CELL_03};

static void advertise(cell_num_t c) {
    if (tx == NULL) tx = malloc(sizeof(IR_message_t));
    init_IR_message(tx);
    tx->type = MSG_CELL;
    tx->data[0] = cells[c].kind;
    tx->data[1] = cells[c].pheromone;
    tx->data[2] = module_uid_x_coord;
    tx->data[3] = module_uid_y_coord;
    set_IR_message(tx, c);
    if (cells[c].kind == OBSTACLE)
        set_LED_with_brightness(c, RED, HIGH);
    else
        set_LED_with_brightness(c, GREEN, (brightness_t)cells[c].pheromone);
}

void on_ir(IR_message_t *m, cell_num_t c, distance_measurement_t *d, uint8_t CRC_error) {
    if (CRC_error) return;
    switch (m->type) {
    case TRACKING: {
        CAN_message_t *out = next_CAN_message();
        if (out != NULL) serialize_tracking_message(out, c, (tracking_user_data_t *)m->data);
        break;
    }
    case MSG_DEPOSIT:
        cells[c].pheromone =
            cells[c].pheromone > 255 - DEPOSIT ? 255 : cells[c].pheromone + DEPOSIT;
        break;
    }
}

void setup(void) {
    for (uint8_t i = 0; i < N_CELLS; i++) {
        cells[i].kind = i < configuration_size ? configuration[i] : 0;
        cells[i].pheromone = 0;
    }
    last_advertised = last_evaporated = module_ticks;
}

void loop(void) {
    if (module_ticks - last_advertised > ADVERTISE_TICKS) {
        last_advertised = module_ticks;
        for (uint8_t i = 0; i < N_CELLS; i++) advertise(ids[i]);
    }
    if (module_ticks - last_evaporated > EVAPORATION_TICKS) {
        last_evaporated = module_ticks;
        for (uint8_t i = 0; i < N_CELLS; i++) cells[i].pheromone -= cells[i].pheromone >> 3;
    }
    wdt_reset();
}

int main(void) {
    module_init();
    module_IR_message_rx = on_ir;
    module_start(setup, loop);
    return 0;
}
