// The modules' part of the update-time experiment (docs/update_time.md): each cell shows its colour
// and transmits it twice a second. The layout follows from the cell's place on the half table.
#include <kilogrid.h>
#include <module.h>
#include <moduleIR.h>
#include <moduleLED.h>
#include <stdbool.h>

#include "messages.h"

#define ADVERTISE_TICKS (TICKS_PER_SEC / 2)

// In cells of 5 cm: the half table, the band of wall cells, and stripes that begin inside the band.
#define SIDE 20
#define BAND 2
#define STRIPE_WIDTH 3

static uint32_t advertise_at;

static uint8_t column_of(cell_num_t cell) { return 2 * module_uid_x_coord + (cell & 1); }

static uint8_t row_of(cell_num_t cell) { return 2 * module_uid_y_coord + (cell < CELL_02 ? 1 : 0); }

static bool is_in_band(uint8_t at) { return at < BAND || at >= SIDE - BAND; }

static bool is_wall(cell_num_t cell) {
    return is_in_band(column_of(cell)) || is_in_band(row_of(cell));
}

static uint8_t colour_of(cell_num_t cell) {
    if (is_wall(cell)) return GREY;
    const uint8_t from_left = column_of(cell) - BAND;
    const uint8_t from_right = SIDE - BAND - 1 - column_of(cell);
    if (from_left < STRIPE_WIDTH) return BLACK;
    return from_right < STRIPE_WIDTH ? WHITE_CELL : GREY;
}

// The black stripe is dark, the white one bright, and the rest in between.
static void show(cell_num_t cell) {
    switch (colour_of(cell)) {
    case BLACK: set_LED(cell, LED_OFF); break;
    case WHITE_CELL: set_LED_with_brightness(cell, WHITE, HIGH); break;
    default: set_LED_with_brightness(cell, WHITE, LOW);
    }
}

static void advertise(cell_num_t cell) {
    IR_message_t message;
    init_IR_message(&message);
    message.type = MESSAGE_CELL;
    message.data[CELL_COLOUR] = colour_of(cell);
    message.data[CELL_IS_WALL] = is_wall(cell);
    set_IR_message(&message, cell);
}

static void setup(void) { advertise_at = module_ticks; }

static void loop(void) {
    const bool due = module_ticks >= advertise_at;
    if (due) advertise_at = module_ticks + ADVERTISE_TICKS;
    for (uint8_t cell = 0; cell < N_CELLS; cell++) {
        show((cell_num_t)cell);
        if (due) advertise((cell_num_t)cell);
    }
}

int main(void) {
    module_init();
    module_start(setup, loop);
}
