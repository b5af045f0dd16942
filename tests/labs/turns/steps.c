/* Notes each configuration that it gets: setup() adds up their first bytes, and loop() pauses. */
#include <util/delay.h>

#include "module.h"
#include "moduleIR.h"
#include "moduleLED.h"

static uint8_t sum, times;

void setup() {
    times++;
    sum += configuration[0];
}

void loop() {
    set_LED_with_brightness(CELL_00, RED, sum);
    set_LED_with_brightness(CELL_01, RED, times);
    for (uint16_t i = 0; i < PAUSE_MS / 10; i++) _delay_ms(10);
}

int main() {
    module_init();
    module_start(setup, loop);
}
