#include "robots.h"

#include <util/atomic.h>

#include "../core/bursts.h"
#include "../core/traits.h"
#include "commands.h"
#include "moduleIR.h"
#include "moduleLED.h"

static void show(burst_light_t light) {
    for (uint8_t cell = 0; cell < N_CELLS; cell++)
        if ((light.cells >> cell & 1) != 0) set_LED((cell_num_t)cell, (color_t)light.color);
}

// On the stack, 155 bytes for as long as it lasts: no burst runs while the program does.
void runtime_send_burst(job_t job) {
    burst_t burst;
    burst_frame_t frame;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { burst_begin(&burst, &runtime_orders, job); }
    show(burst_light(&burst, &runtime_orders));
    while (burst_next(&burst, &runtime_orders, &frame)) {
        send_IR_message(&frame.message, (cell_num_t)frame.cell);
        show(burst_light(&burst, &runtime_orders));
        if (!MODULE_ORIGINAL && burst_pauses(&burst)) __builtin_avr_delay_cycles(BURST_GAP_CYCLES);
    }
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { burst_end(&burst, &runtime_orders); }
}
